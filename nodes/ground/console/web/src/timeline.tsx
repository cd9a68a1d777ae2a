// The timeline: tasks as planned and flown, passes and the ground's plan, windows of what is selected, alarms; the curves below share its axis.

import { useComputed } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { onCanvas } from "./map";
import { foretold, layout, ROW, type Band, type Bands } from "./radio";
import { lookOf } from "./states";
import { axis, cursor, focus, hasRadio, info, select, selected, shown, span, version, world } from "./store";
import { clock, duration, stamp } from "./time";
import { lastAt, type World } from "./world";

/** Width of the names of bands, and of the plots' axes [px]. */
export const GUTTER = 78;
interface Scene {
  context: CanvasRenderingContext2D;
  x: (t: number) => number;
  width: number;
  bands: Bands;
}

function bar({ context, x, bands }: Scene, band: Band, from: number, to: number, colour: string, hollow = false): void {
  const [left, wide] = [Math.max(GUTTER, x(from)), Math.max(2, x(to) - Math.max(GUTTER, x(from)))];
  if (x(to) < GUTTER) return;
  const { top, high } = bands[band];
  context.fillStyle = context.strokeStyle = colour;
  context.lineWidth = 1;
  if (hollow) context.strokeRect(left + 0.5, top + 4.5, wide - 1, high - 9);
  else context.fillRect(left, top + 4, wide, high - 8);
}

function tasks(scene: Scene, now: World, t: number): void {
  for (const task of now.tasks.values()) {
    const start = now.time(task.start);
    if (start > t) continue;
    const turn = now.time(task.start + task.t_pre);
    const end = now.time(task.end ?? task.start + task.t_pre + task.rest);
    if (scene.x(end) < GUTTER || scene.x(start) > scene.width) continue;
    if (!task.strip) {
      bar(scene, "tasks", start, end, "#3a4a5a");
      continue;
    }
    const failed = task.result && !task.result.success && end <= t;
    const colour = selected.value.has(task.strip) ? "#ff00ff" : failed ? "#d55e00" : task.result && end <= t ? "#17b88a" : "#f0e442";
    bar(scene, "tasks", start, Math.min(turn, end), `${colour}66`);
    if (end > turn) bar(scene, "tasks", turn, end, colour, Boolean(failed));
    label(scene, "tasks", turn, end, now.strips.get(task.strip)?.name ?? "");
  }
}

/** A name on a bar, where there is room for it. */
function label({ context, x, bands }: Scene, band: Band, from: number, to: number, text: string, light = false): void {
  const left = Math.max(GUTTER, x(from));
  const room = x(to) - left - 6;
  if (room < 24) return;
  context.save();
  context.beginPath();
  const { top } = bands[band];
  context.rect(left, top, room + 3, ROW);
  context.clip();
  context.fillStyle = light ? "#dbe5ec" : "#06110d";
  context.font = "10px system-ui, sans-serif";
  context.fillText(text, left + 3, top + 14.5);
  context.restore();
}

/** The windows of the strips that the planner may choose among, each a line, and which was chosen. */
function offered(scene: Scene, now: World, t: number): void {
  const offer = lastAt(now.offers, t);
  if (!offer) return;
  const choice = now.choices.get(offer.task);
  const chosen = choice && choice.t <= t ? choice.candidates[choice.chosen] : undefined;
  const { top, high } = scene.bands.windows;
  const step = Math.min(4, (high - 4) / Math.max(1, offer.candidates.length));
  const { context, x } = scene;
  offer.candidates.forEach(({ strip, open, close }, i) => {
    const left = Math.max(GUTTER, x(now.time(open)));
    if (x(now.time(close)) < GUTTER) return;
    context.fillStyle = selected.value.has(strip) ? "#ff00ff" : strip === chosen ? "#f0e442" : "#56b4e9a0";
    context.fillRect(left, top + 2 + i * step, Math.max(2, x(now.time(close)) - left), Math.max(0.8, step - 0.6));
  });
}

/** A proposal that waits for an operator: until when it can be flown, and when it is decided without one. */
function proposal(scene: Scene, now: World, t: number): void {
  const status = lastAt(now.planner, t);
  if (!status || status.proposal_state !== "open") return;
  bar(scene, "tasks", t, now.time(status.close), "#e69f0055");
  bar(scene, "tasks", t, now.time(status.close), "#e69f00", true);
  label(scene, "tasks", t, now.time(status.close), `approve ${status.name}?`);
  if (status.deadline) bar(scene, "tasks", now.time(status.deadline), now.time(status.deadline), "#ff8a7a");
}

function windows(scene: Scene, now: World, t: number): void {
  offered(scene, now, t);
  for (const id of selected.value) {
    const strip = now.strips.get(id);
    const change = strip && now.changeAt(strip, t);
    if (!change) continue;
    if (change.close_ms) bar(scene, "selected", change.open_ms, change.close_ms, lookOf(change.state).colour);
    if (change.imaging_ms) bar(scene, "selected", change.imaging_ms, change.imaging_ms + 1000, "#ffffff");
  }
  for (const alarm of now.alarms.values()) {
    if (alarm.t <= t) bar(scene, "alarms", alarm.t, alarm.t + 1000, alarm.level > 1 ? "#ff5050" : "#e69f00");
  }
}

/** Passes that were known of: those over pale, those to come hollow; and what the ground had predicted, beside what was flown. */
function radio(scene: Scene, now: World, t: number): void {
  for (const pass of now.passes.values()) {
    if (pass.t > t || scene.x(pass.set_ms) < GUTTER || scene.x(pass.rise_ms) > scene.width) continue;
    const [over, ahead] = [pass.set_ms <= t, pass.rise_ms > t];
    bar(scene, "passes", pass.rise_ms, pass.set_ms, over ? "#56b4e966" : "#56b4e9", ahead);
    label(scene, "passes", pass.rise_ms, pass.set_ms, `${pass.station} ${pass.elevation_deg.toFixed(0)}°`, over || ahead);
  }
  for (const task of foretold(now, t, span.value)) {
    const [start, imaging, end] = [now.time(task.start), now.time(task.imaging), now.time(task.end)];
    const colour = selected.value.has(task.strip) ? "#ff00ff" : task.success ? "#8fb8d8" : "#d55e00";
    bar(scene, "plan", start, imaging, `${colour}55`);
    bar(scene, "plan", imaging, end, colour, !task.success);
    label(scene, "plan", imaging, end, now.strips.get(task.strip)?.name ?? "", !task.success);
  }
}

function marks({ context, x, width, bands }: Scene, [from, to]: [number, number]): void {
  const steps = [10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 21600, 86400].map((seconds) => seconds * 1000);
  const step = steps.find((size) => ((to - from) / size) * 70 < width - GUTTER) ?? 86400000;
  context.font = "11px system-ui, sans-serif";
  for (let at = Math.ceil(from / step) * step; at <= to; at += step) {
    context.fillStyle = "#1b2b3a";
    context.fillRect(x(at), 0, 1, bands.height - 16);
    context.fillStyle = "#9fb4c7";
    context.fillText(clock(at), x(at) - 22, bands.height - 5);
  }
}

function draw(canvas: HTMLCanvasElement): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const [now, t] = [world.value, shown.value];
  const bands = layout(now);
  canvas.width = width * ratio;
  canvas.height = bands.height * ratio;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [from, to] = span.value;
  const x = (t: number) => GUTTER + ((t - from) / (to - from)) * (width - GUTTER);
  const scene = { context, x, width, bands };
  context.clearRect(0, 0, width, bands.height);
  marks(scene, [from, to]);
  tasks(scene, now, t);
  radio(scene, now, t);
  proposal(scene, now, t);
  windows(scene, now, t);
  context.fillStyle = "#0d141b";
  context.fillRect(0, 0, GUTTER - 2, bands.height);
  context.fillStyle = "#9fb4c7";
  for (const { name, top, high } of bands.shown) {
    // With a radio the ground knows of tasks only what comes down.
    context.fillText(name === "tasks" && hasRadio.value ? "tasks · truth" : name, 6, top + 15);
    context.fillStyle = "#1b2b3a";
    context.fillRect(0, top + high - 0.5, width, 0.5);
    context.fillStyle = "#9fb4c7";
  }
  context.fillStyle = cursor.value === null ? "#ffffff" : "#ff00ff";
  if (x(t) >= GUTTER) context.fillRect(x(t), 0, 1.5, bands.height);
}

/** The strip of the task, flown or predicted, under a place of the timeline; 0 for none. */
function stripUnder(y: number, t: number): number {
  const now = world.value;
  const band = layout(now).shown.find(({ top, high }) => y >= top && y < top + high)?.name;
  if (band === "plan") return foretold(now, shown.value, [t, t]).at(-1)?.strip ?? 0;
  const task = band === "tasks" ? now.taskAt(t) : undefined;
  return task && now.time(task.end ?? task.start + task.t_pre + task.rest) >= t ? task.strip : 0;
}

function zoom(at: number, factor: number): void {
  const [from, to] = span.value;
  const wide = Math.max(60000, Math.min(14 * 86400000, (to - from) * factor));
  const share = (at - from) / (to - from);
  axis.value = [at - share * wide, at + (1 - share) * wide];
}

/** Looks at a time; at now, if it lies ahead. */
export function look(t: number | null): void {
  cursor.value = t === null || t >= world.value.now ? null : Math.max(t, world.value.first);
}

export function Timeline() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const height = useComputed(() => layout(world.value).height);
  const held = useRef<{ x: number; moved: boolean } | null>(null);
  useEffect(() => {
    const read = () => [version, shown, span, selected, focus, cursor, info].forEach((it) => it.value);
    return onCanvas(canvas.current!, read, draw);
  }, []);
  const timeAt = (x: number) => {
    const [from, to] = span.value;
    return from + ((x - GUTTER) / ((canvas.current?.clientWidth ?? 1) - GUTTER)) * (to - from);
  };
  return (
    <canvas
      ref={canvas}
      class="timeline"
      height={height}
      tabIndex={0}
      aria-label="Timeline; arrow keys step through time, + and - zoom, Home returns to now"
      onKeyDown={(event) => {
        if (event.key === "ArrowLeft") look(shown.value - 10000);
        else if (event.key === "ArrowRight") look(shown.value + 10000);
        else if (event.key === "Home") look(null);
        else if (event.key === "+") zoom(shown.value, 1 / 1.3);
        else if (event.key === "-") zoom(shown.value, 1.3);
        else return;
        event.preventDefault();
      }}
      onWheel={(event) => {
        event.preventDefault();
        zoom(timeAt(event.offsetX), event.deltaY < 0 ? 1 / 1.2 : 1.2);
      }}
      onPointerDown={(event) => {
        held.current = { x: event.clientX, moved: false };
        event.currentTarget.setPointerCapture(event.pointerId);
      }}
      onPointerMove={(event) => {
        const hold = held.current;
        if (!hold || (!hold.moved && Math.abs(event.clientX - hold.x) < 4)) return;
        const by = timeAt(hold.x) - timeAt(event.clientX);
        const [from, to] = span.value;
        axis.value = [from + by, to + by];
        held.current = { x: event.clientX, moved: true };
      }}
      onPointerUp={(event) => {
        if (held.current && !held.current.moved && event.offsetX > GUTTER) {
          const t = timeAt(event.offsetX);
          const strip = stripUnder(event.offsetY, t);
          if (strip) select(strip, event.shiftKey || event.ctrlKey);
          else look(t);
        }
        held.current = null;
      }}
    />
  );
}

/** The bar above the timeline: the time that is shown, and how to move it. */
export function TimeBar() {
  const [now, t] = [world.value, shown.value];
  const task = now.taskAt(t);
  const strip = task && now.strips.get(task.strip);
  const turn = task ? now.time(task.start + task.t_pre) : 0;
  const end = task ? now.time(task.start + task.t_pre + task.rest) : 0;
  const phase = !task || end < t ? "" : !task.strip ? "waits" : t < turn ? "slews to" : "images";
  const left = t < turn ? turn - t : end - t;
  return (
    <div class="timebar">
      <button onClick={() => look(null)} disabled={cursor.value === null} title="follow simulated time">now</button>
      <button onClick={() => (axis.value = null)} disabled={axis.value === null}>follow</button>
      <button onClick={() => (axis.value = [now.first, Math.max(now.now, now.first + 60000)])}>whole</button>
      <output class="shown">{stamp(t)}{cursor.value === null ? "" : " (past)"}</output>
      <input
        type="range"
        aria-label="time that is shown"
        min={Number.isFinite(now.first) ? now.first : 0}
        max={now.now}
        step={500}
        value={t}
        onInput={(event) => look(Number(event.currentTarget.value))}
      />
      <span class="task">{phase && <><b>{phase}</b> {strip?.name ?? ""} <span class="number">{duration(left)}</span></>}</span>
    </div>
  );
}
