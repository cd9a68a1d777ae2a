// What is known at a time is what had been told of by then, in whatever order it came.

import { expect, test } from "vitest";
import type { ChangeFact, Fact, StripFact } from "../src/facts";
import { lastAt, World } from "../src/world";

const strip: StripFact = {
  n: 1, t: 1000, kind: "strip", id: 7, name: "coast", submitter: "ops", client_ref: "", start: [0, 0], end: [1, 1],
  priority: 0.5, speed_m_s: 3000, linked_to: 0, supersedes: 0,
};
const change = (n: number, t: number, state: number): ChangeFact => ({
  n, t, kind: "change", strip: 7, state, reason_code: 0, reason: "", actor: "", attempts: 0, reward: 0, open_ms: 0,
  close_ms: 0, imaging_ms: 0, superseded_by: 0,
});

function worldOf(...facts: Fact[]): World {
  const world = new World();
  facts.forEach((fact) => world.take(fact));
  return world;
}

test("a strip is in the state of its last change before a time", () => {
  const world = worldOf(strip, change(2, 1000, 3), change(3, 5000, 6), change(4, 3000, 4));
  const states = [999, 1000, 2999, 3000, 4999, 5000].map((t) => world.changeAt(world.strips.get(7)!, t)?.state);
  expect(states).toEqual([undefined, 3, 3, 4, 4, 6]);
});

test("the same change told again with more is one change", () => {
  const world = worldOf(strip, change(2, 1000, 3), { ...change(3, 1000, 3), close_ms: 9000 });
  expect(world.strips.get(7)!.changes.map((it) => it.close_ms)).toEqual([9000]);
});

test("a task that ended keeps what was planned", () => {
  const world = worldOf(
    { n: 1, t: 0, kind: "task", task: 3, start: 10, strip: 7, t_pre: 20, t_acq: 30, wait: 0 },
    {
      n: 2, t: 100, kind: "result", task: 3, start: 10, end: 60, strip: 7, name: "coast", t_pre: 20, success: true,
      reason: 0, max_error: 0.01, min_elevation_deg: 40, reward: 0.5,
    },
  );
  expect(world.tasks.get(3)).toMatchObject({ start: 10, t_pre: 20, rest: 30, end: 60, result: { reward: 0.5 } });
});

test("an alarm that is raised again stands again", () => {
  const alarm = { kind: "alarm" as const, alarm: 1, name: "guidance: late", level: 1, text: "late" };
  const world = worldOf({ n: 1, t: 10, ...alarm }, { n: 2, t: 20, kind: "acknowledged", alarm: 1, actor: "console" });
  expect(world.alarms.get(1)!.acknowledged).toBe(true);
  world.take({ n: 3, t: 30, ...alarm });
  expect(world.alarms.get(1)).toMatchObject({ acknowledged: false, count: 2 });
});

test("nothing was true before the first", () => {
  expect(lastAt([{ t: 5 }, { t: 6 }], 4)).toBeUndefined();
  expect(lastAt([{ t: 5 }, { t: 6 }], 6)).toEqual({ t: 6 });
});

test("an alarm that is put aside does not count until its time is over", () => {
  const alarm = { kind: "alarm" as const, alarm: 1, name: "guidance: late", level: 1, text: "late" };
  const world = worldOf(
    { n: 1, t: 10, ...alarm },
    { n: 2, t: 20, kind: "shelved", alarm: 1, until_ms: 100, actor: "console", reason: "known" },
    { n: 3, t: 30, ...alarm },
  );
  const known = world.alarms.get(1)!;
  expect([30, 99, 100].map((t) => world.stands(known, t))).toEqual([false, false, true]);
  expect(known).toMatchObject({ count: 2, aside: { reason: "known" } });
});
