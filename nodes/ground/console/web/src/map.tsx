// The map: flat or as a globe, drawn on a canvas; what is clicked is selected everywhere.

import { effect, signal } from "@preact/signals";
import { geoCircle, geoEquirectangular, geoGraticule10, geoOrthographic, geoPath, type GeoProjection } from "d3-geo";
import { useEffect, useRef } from "preact/hooks";
import { feature } from "topojson-client";
import type { Topology } from "topojson-specification";
import atlas from "world-atlas/land-110m.json";
import { footprintRadius, orbitThrough, placeAt, subsolar, type Place } from "./orbit";
import { lookOf, STATES } from "./states";
import { drawing, drawn, focus, info, select, selected, shown, version, world } from "./store";
import { lastAt, type Strip, type World } from "./world";

const topology = atlas as unknown as Topology;
const land = feature(topology, topology.objects["land"]!);
const grid = geoGraticule10();

/** Time of the ground track that is drawn behind and ahead [ms]. */
const BEHIND = 95 * 60000;
const AHEAD = 2 * BEHIND;
const STEP = 30000;
/** How near to a strip a click selects it [px]. */
const NEAR = 8;

export const globe = signal(false);
export const view = signal({ lon: 0, lat: 0, zoom: 1 });
/** States that the map leaves out. */
export const hidden = signal<ReadonlySet<number>>(new Set());

function projection(width: number, height: number): GeoProjection {
  const { lon, lat, zoom } = view.value;
  if (globe.value) {
    const radius = Math.min(width, height) / 2.1;
    return geoOrthographic().rotate([-lon, -lat]).scale(radius * zoom).translate([width / 2, height / 2]).clipAngle(90);
  }
  const scale = (Math.max(width / (2 * Math.PI), height / Math.PI) * zoom);
  return geoEquirectangular().rotate([-lon, 0]).center([0, lat]).scale(scale).translate([width / 2, height / 2]);
}

/** Whether both ends of a strip are in what the map shows; no canvas, everything is. */
export function inView(strip: Strip): boolean {
  if (!size) return true;
  const project = projection(size[0], size[1]);
  return [strip.start, strip.end].some((end) => {
    const at = project(end);
    return at !== null && at[0] >= 0 && at[1] >= 0 && at[0] <= size![0] && at[1] <= size![1];
  });
}

/** Moves the map to a strip that it does not show. */
export function reveal(strip: Strip): void {
  const [lon, lat] = strip.start;
  const path = size && geoPath(projection(size[0], size[1]));
  const seen = path && path.measure({ type: "LineString", coordinates: [strip.start, strip.end] }) > 0;
  if (seen && inView(strip)) return;
  following.value = false;
  view.value = { ...view.value, lon, lat: globe.value || view.value.zoom > 1 ? lat : 0 };
}

let size: [number, number] | undefined;

const lines = (coordinates: Place[][]) => ({ type: "MultiLineString" as const, coordinates });

function track(now: World, t: number): { behind: Place[]; ahead: Place[] } {
  const behind = now.points.filter((point) => point.t <= t && point.t > t - BEHIND);
  const ahead: Place[] = [];
  const [before, last] = behind.slice(-2);
  const orbit = before && last && orbitThrough(before, last);
  if (orbit) for (let at = t; at <= t + AHEAD; at += STEP) ahead.push(placeAt(orbit, at));
  return { behind: behind.map((point) => [point.lon, point.lat]), ahead };
}

/** Where the satellite is at a time: the last point that was told, carried on. */
function satellite(now: World, t: number): { place: Place; altitude: number } | undefined {
  const last = lastAt(now.points, t);
  if (!last) return undefined;
  const before = lastAt(now.points, last.t - 1);
  const orbit = before && orbitThrough(before, last);
  return { place: orbit ? placeAt(orbit, t) : [last.lon, last.lat], altitude: last.altitude_m };
}

function draw(canvas: HTMLCanvasElement): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  size = [width, height];
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== width * ratio || canvas.height !== height * ratio) {
    canvas.width = width * ratio;
    canvas.height = height * ratio;
  }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const path = geoPath(projection(width, height), context);
  const now = world.value;
  const t = shown.value;
  const stroke = (shape: Parameters<typeof path>[0], colour: string, line: number, dash: number[] = []) => {
    context.beginPath();
    path(shape);
    context.strokeStyle = colour;
    context.lineWidth = line;
    context.setLineDash(dash);
    context.stroke();
  };
  const fill = (shape: Parameters<typeof path>[0], colour: string) => {
    context.beginPath();
    path(shape);
    context.fillStyle = colour;
    context.fill();
  };
  context.fillStyle = "#070c11";
  context.fillRect(0, 0, width, height);
  fill({ type: "Sphere" }, "#10212f");
  fill(land, "#2f4558");
  stroke(land, "#4a647a", 0.5);
  stroke(grid, "#ffffff12", 0.5);
  if (t > 0) {
    const [lon, lat] = subsolar(t);
    fill(geoCircle().center([lon + 180, -lat]).radius(90)(), "#00000055");
  }
  strips(now, t, stroke);
  const { behind, ahead } = track(now, t);
  stroke(lines([behind]), "#e8eef3", 1.6);
  stroke(lines([ahead]), "#e8eef3a0", 1, [3, 5]);
  const at = satellite(now, t);
  if (at) {
    const elevation = info.value.elevation_min_deg;
    if (elevation > 0) {
      const shape = geoCircle().center(at.place).radius(footprintRadius(at.altitude, elevation))();
      stroke(shape, "#e8eef390", 1);
      fill(shape, "#e8eef314");
    }
    const project = projection(width, height);
    arrow(context, project, at.place, ahead[1] ?? at.place, path);
  }
  const marks = drawn.value;
  if (marks.length) {
    stroke(lines([marks]), "#ff00ff", 3);
    for (const mark of marks) fill(geoCircle().center(mark).radius(0.5 / view.value.zoom)(), "#ff00ff");
  }
}

function strips(now: World, t: number, stroke: (shape: GeoJSON.MultiLineString, colour: string, width: number, dash?: number[]) => void): void {
  const byState = STATES.map(() => [] as Place[][]);
  const chosen: Place[][] = [];
  for (const strip of now.strips.values()) {
    const change = now.changeAt(strip, t);
    if (!change || hidden.value.has(change.state)) continue;
    byState[change.state]?.push([strip.start, strip.end]);
    if (selected.value.has(strip.id)) chosen.push([strip.start, strip.end]);
  }
  const offer = lastAt(now.offers, t)?.candidates.flatMap(({ strip }) => now.strips.get(strip) ?? []) ?? [];
  stroke(lines(offer.map((strip) => [strip.start, strip.end])), "#ffffff30", 8);
  byState.forEach((places, state) => {
    const look = lookOf(state);
    if (places.length) stroke(lines(places), look.colour, look.width, look.dash);
  });
  if (chosen.length) stroke(lines(chosen), "#ff00ff", 4);
}

/** The satellite, pointing where it flies; nothing on the far side of the globe. */
function arrow(context: CanvasRenderingContext2D, project: GeoProjection, place: Place, next: Place, path: ReturnType<typeof geoPath>): void {
  if (path.measure({ type: "LineString", coordinates: [place, [place[0] + 0.1, place[1]]] }) === 0) return;
  const [from, to] = [project(place), project(next)];
  if (!from || !to) return;
  context.save();
  context.translate(from[0], from[1]);
  context.rotate(Math.atan2(to[1] - from[1], to[0] - from[0]));
  context.beginPath();
  context.moveTo(11, 0);
  context.lineTo(-6, 6);
  context.lineTo(-3, 0);
  context.lineTo(-6, -6);
  context.closePath();
  context.fillStyle = "#ffffff";
  context.strokeStyle = "#05090d";
  context.lineWidth = 1.5;
  context.setLineDash([]);
  context.stroke();
  context.fill();
  context.restore();
}

/** The strip nearest to a point of the canvas; 0 when none is near. */
function nearest(x: number, y: number): number {
  if (!size) return 0;
  const project = projection(size[0], size[1]);
  let [best, least] = [0, NEAR];
  for (const strip of world.value.strips.values()) {
    const change = world.value.changeAt(strip, shown.value);
    if (!change || hidden.value.has(change.state)) continue;
    const [from, to] = [project(strip.start), project(strip.end)];
    if (!from || !to) continue;
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const along = ((x - from[0]) * dx + (y - from[1]) * dy) / (dx * dx + dy * dy || 1);
    const share = Math.max(0, Math.min(1, along));
    const distance = Math.hypot(from[0] + share * dx - x, from[1] + share * dy - y);
    if (distance < least) [best, least] = [strip.id, distance];
  }
  return best;
}

function onClick(event: MouseEvent): void {
  if (!size) return;
  if (drawing.value) {
    const place = projection(size[0], size[1]).invert?.([event.offsetX, event.offsetY]);
    if (!place) return;
    drawn.value = drawn.value.length >= 2 ? [place] : [...drawn.value, place];
    if (drawn.value.length >= 2) drawing.value = false;
    return;
  }
  select(nearest(event.offsetX, event.offsetY), event.ctrlKey || event.shiftKey);
}

/** Whether the map keeps the satellite in its middle. */
const following = signal(false);

effect(() => {
  if (!following.value) return;
  const at = satellite(world.value, shown.value);
  const known = view.peek();
  if (at) view.value = { lon: at.place[0], lat: globe.value ? at.place[1] : known.lat, zoom: known.zoom };
});

function pan(dx: number, dy: number): void {
  following.value = false;
  const { lon, lat, zoom } = view.value;
  const degrees = 180 / (Math.PI * (projection(...(size ?? [800, 400])).scale() || 1));
  const turned = ((((lon - dx * degrees + 180) % 360) + 360) % 360) - 180;
  view.value = { lon: turned, lat: Math.max(-89, Math.min(89, lat + dy * degrees)), zoom };
}

function zoomBy(factor: number): void {
  const { lon, lat, zoom } = view.value;
  view.value = { lon, lat, zoom: Math.max(0.5, Math.min(60, zoom * factor)) };
}

/** What the pointer is on. */
const hint = signal<{ x: number; y: number; text: string } | null>(null);

function point(event: PointerEvent): void {
  const [x, y] = [event.offsetX, event.offsetY];
  const strip = world.value.strips.get(nearest(x, y));
  const change = strip && world.value.changeAt(strip, shown.value);
  if (strip && change) {
    hint.value = { x, y, text: `${strip.id} ${strip.name} · ${lookOf(change.state).name} · ${strip.priority.toFixed(2)}` };
    return;
  }
  const place = drawing.value && size ? projection(size[0], size[1]).invert?.([x, y]) : undefined;
  hint.value = place ? { x, y, text: `${place[1].toFixed(2)}, ${place[0].toFixed(2)}` } : null;
}

function onKey(event: KeyboardEvent): void {
  const steps: Record<string, [number, number]> = {
    ArrowLeft: [60, 0],
    ArrowRight: [-60, 0],
    ArrowUp: [0, 60],
    ArrowDown: [0, -60],
  };
  const step = steps[event.key];
  if (step) pan(...step);
  else if (event.key === "+") zoomBy(1.3);
  else if (event.key === "-") zoomBy(1 / 1.3);
  else return;
  event.preventDefault();
}

/** Draws again when something that it shows has changed, once a frame at most. */
export function onCanvas(canvas: HTMLCanvasElement, read: () => void, paint: (canvas: HTMLCanvasElement) => void): () => void {
  let asked = 0;
  const ask = () => {
    if (!asked)
      asked = requestAnimationFrame(() => {
        asked = 0;
        paint(canvas);
      });
  };
  const stop = effect(() => {
    read();
    ask();
  });
  const watch = new ResizeObserver(ask);
  watch.observe(canvas);
  return () => {
    stop();
    watch.disconnect();
    cancelAnimationFrame(asked);
  };
}

export function WorldMap() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const held = useRef<{ x: number; y: number; moved: boolean } | null>(null);
  useEffect(() => {
    const target = canvas.current!;
    const read = () =>
      [version, shown, view, globe, hidden, selected, focus, drawn, info].forEach((it) => it.value);
    return onCanvas(target, read, draw);
  }, []);
  return (
    <section class="map" aria-label="Map">
      <canvas
        ref={canvas}
        tabIndex={0}
        aria-label="Map of strips; arrow keys move it, + and - zoom"
        class={drawing.value ? "drawing" : ""}
        onKeyDown={onKey}
        onWheel={(event) => {
          event.preventDefault();
          zoomBy(event.deltaY < 0 ? 1.2 : 1 / 1.2);
        }}
        onPointerLeave={() => (hint.value = null)}
        onPointerDown={(event) => {
          hint.value = null;
          held.current = { x: event.clientX, y: event.clientY, moved: false };
          event.currentTarget.setPointerCapture(event.pointerId);
        }}
        onPointerMove={(event) => {
          const hold = held.current;
          if (!hold) return point(event);
          const [dx, dy] = [event.clientX - hold.x, event.clientY - hold.y];
          if (!hold.moved && Math.hypot(dx, dy) < 4) return;
          pan(dx, dy);
          held.current = { x: event.clientX, y: event.clientY, moved: true };
        }}
        onPointerUp={(event) => {
          if (held.current && !held.current.moved) onClick(event);
          held.current = null;
        }}
      />
      {hint.value && <div class="hint" style={{ left: `${hint.value.x + 14}px`, top: `${hint.value.y + 10}px` }}>{hint.value.text}</div>}
      {drawing.value && <p class="prompt" role="status">{drawn.value.length === 1 ? "click where the strip ends" : "click where the strip starts"}</p>}
      <div class="tools">
        <button aria-pressed={globe.value} onClick={() => (globe.value = !globe.value)}>globe</button>
        <button aria-pressed={following.value} onClick={() => (following.value = !following.value)}>follow</button>
        <button aria-label="zoom in" onClick={() => zoomBy(1.5)}>+</button>
        <button aria-label="zoom out" onClick={() => zoomBy(1 / 1.5)}>−</button>
        <button onClick={() => {
          following.value = false;
          view.value = { lon: 0, lat: 0, zoom: 1 };
        }}>whole</button>
      </div>
      <Legend />
    </section>
  );
}

function Legend() {
  const t = shown.value;
  const counts = new Map<number, number>();
  for (const strip of world.value.strips.values()) {
    const change = world.value.changeAt(strip, t);
    if (change) counts.set(change.state, (counts.get(change.state) ?? 0) + 1);
  }
  const toggle = (state: number) => {
    const next = new Set(hidden.value);
    if (!next.delete(state)) next.add(state);
    hidden.value = next;
  };
  return (
    <ul class="legend">
      {[...counts.keys()].sort((a, b) => a - b).map((state) => {
        const look = lookOf(state);
        return (
          <li key={state}>
            <button aria-pressed={!hidden.value.has(state)} onClick={() => toggle(state)}>
              <svg width="26" height="8">
                <line x1="0" x2="26" y1="4" y2="4" stroke={look.colour} stroke-width={look.width} stroke-dasharray={look.dash.join(" ")} />
              </svg>
              {look.name} {counts.get(state)}
            </button>
          </li>
        );
      })}
    </ul>
  );
}
