// The timeline: tasks as planned and flown, windows of what is selected, alarms; the curves below share its axis.

import { useEffect, useRef } from "preact/hooks";
import { onCanvas } from "./map";
import { lookOf } from "./states";
import { axis, cursor, focus, info, select, selected, shown, span, version, world } from "./store";
import { clock, duration, stamp } from "./time";
import { lastAt, type Task, type World } from "./world";

/** Width of the names of bands, and of the plots' axes [px]. */
export const GUTTER = 78;
const ROW = 22;
const BANDS = ["tasks", "offered", "selected", "alarms"];
const HEIGHT = BANDS.length * ROW + 20;

interface Scene {
  context: CanvasRenderingContext2D;
  x: (t: number) => number;
  width: number;
}

function bar({ context, x }: Scene, row: number, from: number, to: number, colour: string, hollow = false): void {
  const [left, wide] = [Math.max(GUTTER, x(from)), Math.max(2, x(to) - Math.max(GUTTER, x(from)))];
  if (x(to) < GUTTER) return;
  context.fillStyle = context.strokeStyle = colour;
  if (hollow) context.strokeRect(left + 0.5, row * ROW + 4.5, wide - 1, ROW - 9);
  else context.fillRect(left, row * ROW + 4, wide, ROW - 8);
}

function tasks(scene: Scene, now: World, t: number): void {
  for (const task of now.tasks.values()) {
    const start = now.time(task.start);
    if (start > t) continue;
    const turn = now.time(task.start + task.t_pre);
    const end = now.time(task.end ?? task.start + task.t_pre + task.rest);
    if (scene.x(end) < GUTTER || scene.x(start) > scene.width) continue;
    if (!task.strip) {
      bar(scene, 0, start, end, "#3a4a5a");
      continue;
    }
    const failed = task.result && !task.result.success && end <= t;
    const colour = selected.value.has(task.strip) ? "#ff00ff" : failed ? "#d55e00" : task.result && end <= t ? "#009e73" : "#f0e442";
    bar(scene, 0, start, Math.min(turn, end), `${colour}66`);
    if (end > turn) bar(scene, 0, turn, end, colour, Boolean(failed));
  }
}

function windows(scene: Scene, now: World, t: number): void {
  const offer = lastAt(now.offers, t);
  for (const { strip, open, close } of offer?.candidates ?? []) {
    bar(scene, 1, now.time(open), now.time(close), selected.value.has(strip) ? "#ff00ff88" : "#56b4e944");
  }
  for (const id of selected.value) {
    const strip = now.strips.get(id);
    const change = strip && now.changeAt(strip, t);
    if (!change) continue;
    if (change.close_ms) bar(scene, 2, change.open_ms, change.close_ms, lookOf(change.state).colour);
    if (change.imaging_ms) bar(scene, 2, change.imaging_ms, change.imaging_ms + 1000, "#ffffff");
  }
  for (const alarm of now.alarms.values()) {
    if (alarm.t <= t) bar(scene, 3, alarm.t, alarm.t + 1000, alarm.level > 1 ? "#ff5050" : "#e69f00");
  }
}

function marks({ context, x, width }: Scene, [from, to]: [number, number]): void {
  const steps = [10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 21600, 86400].map((seconds) => seconds * 1000);
  const step = steps.find((size) => ((to - from) / size) * 70 < width - GUTTER) ?? 86400000;
  context.font = "11px system-ui, sans-serif";
  for (let at = Math.ceil(from / step) * step; at <= to; at += step) {
    context.fillStyle = "#1b2b3a";
    context.fillRect(x(at), 0, 1, HEIGHT - 16);
    context.fillStyle = "#9fb4c7";
    context.fillText(clock(at), x(at) - 22, HEIGHT - 5);
  }
}

function draw(canvas: HTMLCanvasElement): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  canvas.width = width * ratio;
  canvas.height = HEIGHT * ratio;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [from, to] = span.value;
  const x = (t: number) => GUTTER + ((t - from) / (to - from)) * (width - GUTTER);
  const scene = { context, x, width };
  context.clearRect(0, 0, width, HEIGHT);
  marks(scene, [from, to]);
  const [now, t] = [world.value, shown.value];
  tasks(scene, now, t);
  windows(scene, now, t);
  context.fillStyle = "#0d141b";
  context.fillRect(0, 0, GUTTER - 2, HEIGHT);
  context.fillStyle = "#9fb4c7";
  BANDS.forEach((name, row) => context.fillText(name, 6, row * ROW + 15));
  context.fillStyle = cursor.value === null ? "#ffffff" : "#ff00ff";
  if (x(t) >= GUTTER) context.fillRect(x(t), 0, 1.5, HEIGHT);
}

function taskUnder(t: number): Task | undefined {
  const now = world.value;
  const task = now.taskAt(t);
  return task && now.time(task.end ?? task.start + task.t_pre + task.rest) >= t ? task : undefined;
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
      height={HEIGHT}
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
          const task = event.offsetY < ROW ? taskUnder(t) : undefined;
          if (task?.strip) select(task.strip, event.shiftKey || event.ctrlKey);
          else look(t);
        }
        held.current = null;
      }}
    />
  );
}

/** The bar above the timeline: the time that is shown, and how to move it. */
export function TimeBar() {
  version.value;
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
      <span class="task">{phase ? `${phase} ${strip?.name ?? ""} · ${duration(left)}` : ""}</span>
    </div>
  );
}
