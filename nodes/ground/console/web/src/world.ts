// What is known, folded from the facts; kept with its history, so that it can be asked for any time.

import type * as f from "./facts";

/** A request with its changes, in order of time. */
export interface Strip extends f.StripFact {
  changes: f.ChangeFact[];
}

/** A task, as chosen and as it went. */
export interface Task {
  task: number;
  start: number;
  strip: number;
  t_pre: number;
  /** Ticks after the transition, or of the wait. */
  rest: number;
  end?: number;
  result?: f.ResultFact;
}

export interface Alarm extends f.AlarmFact {
  acknowledged: boolean;
  /** Whether what was wrong is no more. */
  returned: boolean;
  count: number;
  /** Who has seen it. */
  by: string;
  /** Until when and why it is put aside. */
  aside?: f.ShelvedFact;
}

/** A pass, and when it was told of first. */
export interface KnownPass extends f.Pass {
  t: number;
}

/** The last of a list that is ordered by time which was true at `t`. */
export function lastAt<T extends { t: number }>(list: readonly T[], t: number): T | undefined {
  let [low, high] = [0, list.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((list[middle] as T).t <= t) low = middle + 1;
    else high = middle;
  }
  return list[low - 1];
}

function insert<T extends { t: number }>(list: T[], item: T): void {
  let at = list.length;
  while (at > 0 && (list[at - 1] as T).t > item.t) at -= 1;
  list.splice(at, 0, item);
}

export class World {
  epoch_ms = 0;
  tick_ms = 500;
  first = Infinity;
  now = 0;
  readonly strips = new Map<number, Strip>();
  readonly tasks = new Map<number, Task>();
  readonly points: f.PointFact[] = [];
  readonly status: f.StatusFact[] = [];
  readonly wheels: f.WheelsFact[] = [];
  readonly offers: f.OfferFact[] = [];
  readonly choices = new Map<number, f.ChoiceFact>();
  readonly planner: f.PlannerFact[] = [];
  readonly summaries: f.SummaryFact[] = [];
  readonly refused: f.RefusedFact[] = [];
  readonly alarms = new Map<number, Alarm>();
  readonly links: f.LinkFact[] = [];
  readonly plans: f.PlanFact[] = [];
  readonly resources: f.ResourcesFact[] = [];
  /** Passes that were told of, by station and rise. */
  readonly passes = new Map<string, KnownPass>();
  /** Which nodes are there, and how often each has come back. */
  nodes: f.NodesFact | undefined;

  take(fact: f.Fact): void {
    if (fact.t > 0) {
      this.now = Math.max(this.now, fact.t);
      this.first = Math.min(this.first, fact.t);
    }
    switch (fact.kind) {
      case "clock":
        this.epoch_ms = fact.epoch_ms;
        this.tick_ms = fact.tick_ms;
        break;
      case "strip":
        this.strips.set(fact.id, { ...fact, changes: this.strips.get(fact.id)?.changes ?? [] });
        break;
      case "change": {
        const strip = this.strips.get(fact.strip);
        if (!strip) break;
        const known = strip.changes.findIndex((it) => it.t === fact.t && it.state === fact.state);
        // More is known of the same change.
        if (known >= 0) strip.changes[known] = fact;
        else insert(strip.changes, fact);
        break;
      }
      case "point":
        insert(this.points, fact);
        break;
      case "status":
        insert(this.status, fact);
        break;
      case "wheels":
        insert(this.wheels, fact);
        break;
      case "task":
        this.tasks.set(fact.task, {
          task: fact.task,
          start: fact.start,
          strip: fact.strip,
          t_pre: fact.t_pre,
          rest: fact.strip ? fact.t_acq : fact.wait,
        });
        break;
      case "result":
        this.ended(fact);
        break;
      case "offer":
        insert(this.offers, fact);
        break;
      case "choice":
        this.choices.set(fact.task, fact);
        break;
      case "planner":
        insert(this.planner, fact);
        break;
      case "summary":
        insert(this.summaries, fact);
        break;
      case "refused":
        this.refused.push(fact);
        break;
      case "alarm":
        this.alarms.set(fact.alarm, {
          ...this.alarms.get(fact.alarm),
          ...fact,
          acknowledged: false,
          returned: false,
          by: "",
          count: (this.alarms.get(fact.alarm)?.count ?? 0) + 1,
        });
        break;
      case "returned": {
        const alarm = this.alarms.get(fact.alarm);
        if (alarm) alarm.returned = true;
        break;
      }
      case "acknowledged": {
        const alarm = this.alarms.get(fact.alarm);
        if (alarm) Object.assign(alarm, { acknowledged: true, by: fact.actor });
        break;
      }
      case "shelved": {
        const alarm = this.alarms.get(fact.alarm);
        if (alarm) alarm.aside = fact;
        break;
      }
      case "nodes":
        this.nodes = fact;
        break;
      case "link":
        insert(this.links, fact);
        for (const pass of fact.passes) {
          const key = `${pass.station} ${pass.rise_ms}`;
          if (!this.passes.has(key)) this.passes.set(key, { ...pass, t: fact.t });
        }
        break;
      case "plan":
        insert(this.plans, fact);
        break;
      case "resources":
        insert(this.resources, fact);
        break;
    }
  }

  private ended(fact: f.ResultFact): void {
    const { task, start, strip, t_pre } = fact;
    const rest = Math.max(0, fact.end - start - t_pre);
    this.tasks.set(task, { task, start, strip, t_pre, rest, ...this.tasks.get(task), end: fact.end, result: fact });
  }

  /** Simulated time of a tick [ms]. */
  time(tick: number): number {
    return this.epoch_ms + tick * this.tick_ms;
  }

  /** How a request stood at a time; nothing before it was asked for. */
  changeAt(strip: Strip, t: number): f.ChangeFact | undefined {
    return lastAt(strip.changes, t);
  }

  /** Whether an alarm counts at a time: nobody has seen it, and it is not put aside. */
  stands(alarm: Alarm, t: number): boolean {
    return !alarm.acknowledged && (alarm.aside?.until_ms ?? 0) <= t;
  }

  /** The task that was flown at a time. */
  taskAt(t: number): Task | undefined {
    const all = [...this.tasks.values()];
    return all.findLast((task) => this.time(task.start) <= t);
  }
}
