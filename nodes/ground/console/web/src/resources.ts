// Resources as curves.

import type { ResourcesFact } from "./facts";

/** Battery, storage, and momentum of its limit where that is known [%]. */
export function percents(facts: readonly ResourcesFact[]): (number | null)[][] {
  const percent = (share: number | null) => (share === null ? null : share * 100);
  return [(it: ResourcesFact) => it.battery, (it: ResourcesFact) => it.storage, (it: ResourcesFact) => it.momentum].map((of) =>
    facts.map((it) => percent(of(it))),
  );
}
