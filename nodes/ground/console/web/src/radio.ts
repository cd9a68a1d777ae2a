// What the facts say of the radio and of the ground's plan at a time, and the timeline's bands, of which some are in missions with a radio.

import type { LinkFact, Pass, Planned } from "./facts";
import { lastAt, type World } from "./world";

/** How the radio stands at a time: what was told last, the pass that is under way, and the next one. */
export interface Standing {
  told: LinkFact;
  open: boolean;
  under?: Pass;
  next?: Pass;
}

/** How the radio stands at a time; nothing before it was told of. */
export function standingAt(world: World, t: number): Standing | undefined {
  const told = lastAt(world.links, t);
  if (!told) return undefined;
  // The radio may have several stations at once: the one that hears longest.
  const under = told.passes.filter((it) => it.rise_ms <= t && t < it.set_ms).sort((a, b) => b.set_ms - a.set_ms)[0];
  return { told, open: told.open, under, next: told.passes.find((it) => it.rise_ms > t) };
}

/** What was predicted up to a time, of what the axis shows: of each plan what begins to image before the next one was made. */
export function foretold(world: World, t: number, [from, to]: readonly [number, number]): Planned[] {
  const tasks: Planned[] = [];
  for (const [i, plan] of world.plans.entries()) {
    if (plan.t > t) break;
    const next = world.plans[i + 1];
    const until = next && next.t <= t ? next.t : Infinity;
    if (until < from) continue;
    for (const task of plan.tasks) {
      const imaging = world.time(task.imaging);
      if (imaging >= until) break;
      // What had begun by then was in the plan before.
      const begins = i === 0 || imaging >= plan.t;
      if (begins && world.time(task.end) >= from && world.time(task.start) <= to) tasks.push(task);
    }
  }
  return tasks;
}

/** Height of a band of the timeline [px]. */
export const ROW = 22;

export type Band = "tasks" | "plan" | "passes" | "windows" | "selected" | "alarms";

/** Where a band is [px]. */
export interface Place {
  name: Band;
  top: number;
  high: number;
}

export type Bands = Record<Band, Place> & { shown: Place[]; height: number };

/** The bands from top to bottom, and their heights [px]: of windows there are many. */
const BANDS: readonly [Band, number, (world: World) => boolean][] = [
  ["tasks", ROW, () => true],
  ["plan", ROW, (world) => world.plans.length > 0],
  ["passes", ROW, (world) => world.passes.size > 0],
  ["windows", 42, () => true],
  ["selected", ROW, () => true],
  ["alarms", ROW, () => true],
];

/** Where the bands are; those for what the mission does not have take no room. */
export function layout(world: World): Bands {
  const places: Place[] = [];
  let top = 0;
  for (const [name, full, here] of BANDS) {
    const high = here(world) ? full : 0;
    places.push({ name, top, high });
    top += high;
  }
  const bands = Object.fromEntries(places.map((it) => [it.name, it])) as Record<Band, Place>;
  return { ...bands, shown: places.filter((it) => it.high > 0), height: top + 20 };
}
