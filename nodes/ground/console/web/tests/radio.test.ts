// What is known of the radio at a time is what had been told of by then, and so is what was predicted.

import { expect, test } from "vitest";
import type { Fact, LinkFact, PlanFact, Planned } from "../src/facts";
import { foretold, layout, ROW, standingAt } from "../src/radio";
import { World } from "../src/world";

const pass = (station: string, rise_ms: number, set_ms: number) => ({ station, rise_ms, set_ms, elevation_deg: 40 });
const link = (t: number, more: Partial<LinkFact>): LinkFact => ({
  n: 1, t, kind: "link", open: false, waiting_orders: 0, waiting_changes: 0, on_board: 0, imaged: 0, delivered: 0,
  frames_sent: 0, frames_heard: 0, frames_damaged: 0, housekeeping: null, housekeeping_task: 0,
  housekeeping_pending: 0, housekeeping_imaged: 0, passes: [], ...more,
});
/** A task that images from its tick on, for ten ticks, after ten ticks of transition. */
const planned = (strip: number, imaging: number): Planned => ({
  task: strip, strip, start: imaging - 10, imaging, end: imaging + 10, success: true, known: 0,
});
const plan = (t: number, tasks: Planned[]): PlanFact => ({
  n: 1, t, kind: "plan", since: 0, until: 0, tasks, left_out: 0, compared: 0, equal: 0, imaged: 0, foretold: 0,
  partings: 0, parted_task: 0, parted: 0, parted_reason: "",
});

/** Ticks are half seconds from 1000 s on. */
function worldOf(...facts: Fact[]): World {
  const world = new World();
  world.take({ n: 1, t: 1_000_000, kind: "clock", epoch_ms: 1_000_000, tick_ms: 500 });
  facts.forEach((fact) => world.take(fact));
  return world;
}

test("the radio stands as it was told of last, and the next pass is one to come", () => {
  const passes = [pass("awarua", 1100, 1300), pass("weilheim", 1200, 1250), pass("awarua", 7000, 7300)];
  const world = worldOf(link(1000, { passes }), link(1100, { passes, open: true, waiting_orders: 3 }));
  expect(standingAt(world, 999)).toBeUndefined();
  expect(standingAt(world, 1050)).toMatchObject({ open: false, next: { rise_ms: 1100 } });
  expect(standingAt(world, 1050)!.under).toBeUndefined();
  expect(standingAt(world, 1220)).toMatchObject({
    open: true, told: { waiting_orders: 3 }, under: { station: "awarua", set_ms: 1300 }, next: { rise_ms: 7000 },
  });
  expect(standingAt(world, 1300)!.under).toBeUndefined();
  expect(standingAt(world, 7000)!.next).toBeUndefined();
});

test("a pass is known from when it was told of first, and stays when it is over", () => {
  const [first, second] = [pass("awarua", 1100, 1300), pass("awarua", 7000, 7300)];
  const world = worldOf(link(1000, { passes: [first] }), link(1400, { passes: [second] }), link(1500, { passes: [second] }));
  expect([...world.passes.values()].map((it) => [it.rise_ms, it.t])).toEqual([[1100, 1000], [7000, 1400]]);
});

test("of each plan counts what begins before the next one was made", () => {
  const world = worldOf(
    plan(1_000_000, [planned(1, 20), planned(2, 100), planned(3, 300)]),
    // It was made at tick 200, while 2 was over, and plans 4 in 3's place.
    plan(1_100_000, [planned(2, 100), planned(4, 310), planned(5, 400)]),
  );
  const strips = (t: number, span: [number, number]) => foretold(world, t, span).map((it) => it.strip);
  const whole: [number, number] = [0, 2_000_000];
  expect(strips(999_999, whole)).toEqual([]);
  // At a time before the second one the first one counts as a whole.
  expect(strips(1_099_999, whole)).toEqual([1, 2, 3]);
  expect(strips(1_100_000, whole)).toEqual([1, 2, 4, 5]);
  // Only what the axis shows; a bar that reaches into it does.
  expect(strips(1_100_000, [1_054_000, 1_160_000])).toEqual([2, 4]);
  expect(strips(1_100_000, [1_055_001, 1_149_999])).toEqual([]);
});

test("what the mission does not have takes no room on the timeline", () => {
  const without = layout(worldOf());
  expect(without.shown.map((it) => it.name)).toEqual(["tasks", "windows", "selected", "alarms"]);
  const world = worldOf(link(1000, { passes: [pass("awarua", 1100, 1300)] }), plan(1000, []));
  const all = layout(world);
  expect(all.shown.map((it) => [it.name, it.top])).toEqual([
    ["tasks", 0], ["plan", ROW], ["passes", 2 * ROW], ["windows", 3 * ROW], ["selected", 3 * ROW + 42], ["alarms", 4 * ROW + 42],
  ]);
  expect(all.height - without.height).toBe(2 * ROW);
  // A radio that is always open has no passes.
  expect(layout(worldOf(link(1000, { open: true }))).shown).toHaveLength(4);
});
