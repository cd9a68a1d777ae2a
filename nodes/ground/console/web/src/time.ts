// The one place where times and durations become text.

const pad = (value: number): string => String(value).padStart(2, "0");

/** Simulated time as people read it, or a dash without one. */
export function stamp(ms: number): string {
  return ms > 0 ? new Date(ms).toISOString().slice(0, 19).replace("T", " ") : "–";
}

/** The clock's part of a simulated time. */
export function clock(ms: number): string {
  return ms > 0 ? new Date(ms).toISOString().slice(11, 19) : "–";
}

/** A duration as h:mm:ss, with its sign. */
export function duration(ms: number): string {
  const seconds = Math.round(Math.abs(ms) / 1000);
  const text = `${Math.floor(seconds / 3600)}:${pad(Math.floor(seconds / 60) % 60)}:${pad(seconds % 60)}`;
  return ms < 0 ? `−${text}` : text;
}

/** How a window stands at a time: when it opens or closes. */
export function window(open: number, close: number, t: number): string {
  if (!close || close < t) return close ? "over" : "–";
  return open > t ? `in ${duration(open - t)}` : `closes ${duration(close - t)}`;
}
