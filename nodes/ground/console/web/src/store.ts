// What the page shows: the world, the cursor on its time axis, the selection. Everything that changes is a signal.

import { batch, computed, signal } from "@preact/signals";
import type { Fact } from "./facts";
import { World } from "./world";

export interface Info {
  live: boolean;
  title: string;
  run: string;
  elevation_min_deg: number;
  /** Name of the token; none on the server's own machine. */
  caller: string | null;
  /** Whether whoever looks may command. */
  commands: boolean;
}

const kept = signal(new World());
/** Counts what came in. */
export const version = signal(0);
/** What is known: whoever reads it shows it again when something has come in. */
export const world = {
  get value(): World {
    version.value;
    return kept.value;
  },
};
export const info = signal<Info>({ live: false, title: "", run: "", elevation_min_deg: 0, caller: null, commands: false });
export const connected = signal(false);
/** Whether the server wants a token. */
export const locked = signal(false);
/** Wall-clock time at which something was heard last [ms]. */
export const heard = signal(0);
/** Wall-clock time, every second [ms]. */
export const wall = signal(Date.now());
/** A time that is looked at instead of now [ms]. */
export const cursor = signal<number | null>(null);
export const selected = signal<ReadonlySet<number>>(new Set());
/** The strip that the drawer tells of. */
export const focus = signal(0);
/** Whether clicks on the map draw a strip. */
export const drawing = signal(false);
export const drawn = signal<[number, number][]>([]);
/** Name of the panel that is open. */
export const panel = signal("requests");
/** The strip that what is submitted replaces; 0 for none. */
export const replaced = signal(0);
/** What a new strip is filled with. */
export const draft = signal({ name: "", priority: 0.5, speed: 3000, hold: false, both: false });
/** What the page has to say to who uses it. */
export const message = signal("");

/** The time that is shown [ms]. */
export const shown = computed(() => cursor.value ?? world.value.now);

/** Whether the mission has a radio, and whether it has resources. */
export const hasRadio = computed(() => world.value.links.length > 0);
export const hasResources = computed(() => world.value.resources.length > 0);

/** The span of the time axis [ms]. */
export const axis = signal<[number, number] | null>(null);
export const span = computed<[number, number]>(() => {
  const chosen = axis.value;
  if (chosen) return chosen;
  const at = shown.value;
  return [at - 30 * 60000, at + 20 * 60000];
});

export function take(facts: readonly Fact[]): void {
  batch(() => {
    for (const fact of facts) world.value.take(fact);
    heard.value = Date.now();
    version.value += 1;
  });
}

export function restart(): void {
  batch(() => {
    kept.value = new World();
    version.value += 1;
  });
}

/** Selects one strip, or adds it to the selection or takes it out of it. */
export function select(id: number, more = false): void {
  batch(() => {
    const next = new Set(more ? selected.value : []);
    if (more && next.has(id)) next.delete(id);
    else if (id) next.add(id);
    selected.value = next;
    focus.value = id;
  });
}
