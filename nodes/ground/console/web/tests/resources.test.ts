// Curves of resources: shares in percent, and nothing where a limit is not known.

import { expect, test } from "vitest";
import type { ResourcesFact } from "../src/facts";
import { percents } from "../src/resources";
import { World } from "../src/world";

const resources = (t: number, battery: number, storage: number, momentum: number | null): ResourcesFact => ({
  n: 1, t, kind: "resources", battery, illumination: 1, generated_w: 0, load_w: 0, storage, to_send_bits: 0,
  in_contact: false, momentum_nms: 3, momentum, safe_mode: "none",
});

test("curves are in percent and in order of time, and a gap where the limit of momentum is not known", () => {
  const world = new World();
  for (const fact of [resources(20, 0.75, 0.5, 0.25), resources(10, 1, 0, null)]) world.take(fact);
  expect(world.resources.map(({ t }) => t)).toEqual([10, 20]);
  expect(percents(world.resources)).toEqual([[100, 75], [0, 50], [null, 25]]);
});
