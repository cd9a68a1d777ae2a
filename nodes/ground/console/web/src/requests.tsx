// Requests: a table that holds thousands, filters, what can be done to them, and all that is known of one.

import { computed, signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { get, post, told, tellOutcomes, type Opportunity, type Outcome, type Report } from "./api";
import { inView, view } from "./map";
import { lookOf, STATES } from "./states";
import { focus, info, select, selected, shown, version, world } from "./store";
import { clock, duration, stamp } from "./time";
import type { ChangeFact } from "./facts";
import type { Strip } from "./world";

const ROW = 24;
/** Rows drawn above and below what is seen. */
const SPARE = 10;

const text = signal("");
const state = signal(-1);
const onlyInView = signal(false);
const order = signal<"id" | "closes" | "changed">("changed");

interface Row {
  strip: Strip;
  change: ChangeFact;
}

const rows = computed<Row[]>(() => {
  version.value;
  if (onlyInView.value) view.value;
  const [now, t, sought] = [world.value, shown.value, text.value.toLowerCase()];
  const found: Row[] = [];
  for (const strip of now.strips.values()) {
    const change = now.changeAt(strip, t);
    if (!change || (state.value >= 0 && change.state !== state.value)) continue;
    if (sought && !`${strip.id} ${strip.name} ${strip.submitter} ${strip.client_ref}`.toLowerCase().includes(sought)) continue;
    if (onlyInView.value && !inView(strip)) continue;
    found.push({ strip, change });
  }
  const closes = ({ change }: Row) => (change.close_ms > t ? change.close_ms : Infinity);
  if (order.value === "changed") found.sort((a, b) => b.change.t - a.change.t || a.strip.id - b.strip.id);
  else if (order.value === "closes") found.sort((a, b) => (closes(a) < closes(b) ? -1 : closes(a) > closes(b) ? 1 : a.strip.id - b.strip.id));
  return found;
});

export function Requests() {
  return (
    <div class="requests">
      <Filters />
      {info.value.live && <Actions />}
      <Table />
      {focus.value > 0 && <Drawer id={focus.value} />}
    </div>
  );
}

function Filters() {
  return (
    <div class="filters">
      <input
        type="search"
        placeholder="number, name, submitter"
        aria-label="filter by text"
        value={text.value}
        onInput={(event) => (text.value = event.currentTarget.value)}
      />
      <select aria-label="filter by state" value={state.value} onChange={(event) => (state.value = Number(event.currentTarget.value))}>
        <option value={-1}>every state</option>
        {STATES.map((look, number) => <option key={number} value={number}>{look.name}</option>)}
      </select>
      <select aria-label="order" value={order.value} onChange={(event) => (order.value = event.currentTarget.value as "id")}>
        <option value="changed">last changed</option>
        <option value="closes">closing soon</option>
        <option value="id">number</option>
      </select>
      <label>
        <input type="checkbox" checked={onlyInView.value} onChange={(event) => (onlyInView.value = event.currentTarget.checked)} /> in map view
      </label>
      <span>{rows.value.length}</span>
    </div>
  );
}

async function decide(path: string, done: string, extra: object): Promise<void> {
  const ids = [...selected.value];
  const body = { ids, reason: reason.value, ...extra };
  const outcomes = await told(post<Outcome[]>(path, body));
  if (outcomes) tellOutcomes(done, outcomes);
}

const reason = signal("");

function Actions() {
  const none = selected.value.size === 0;
  return (
    <div class="actions">
      <span>{selected.value.size} selected</span>
      <input placeholder="reason" aria-label="reason" value={reason.value} onInput={(event) => (reason.value = event.currentTarget.value)} />
      <button disabled={none} onClick={() => decide("/api/strips/review", "held", { action: "hold" })}>hold</button>
      <button disabled={none} onClick={() => decide("/api/strips/review", "released", { action: "release" })}>release</button>
      <button disabled={none} onClick={() => decide("/api/strips/review", "rejected", { action: "reject" })}>reject</button>
      <button disabled={none} onClick={() => decide("/api/strips/cancel", "cancelled", {})}>cancel</button>
    </div>
  );
}

function Table() {
  const [top, setTop] = useState(0);
  const [height, setHeight] = useState(600);
  const all = rows.value;
  const first = Math.max(0, Math.floor(top / ROW) - SPARE);
  const part = all.slice(first, first + Math.ceil(height / ROW) + 2 * SPARE);
  const step = (by: number, more: boolean) => {
    const at = all.findIndex(({ strip }) => strip.id === focus.value);
    const next = all[Math.max(0, Math.min(all.length - 1, at + by))];
    if (next) select(next.strip.id, more);
  };
  return (
    <div
      class="table"
      role="grid"
      aria-rowcount={all.length}
      aria-label="requests; arrow keys select, with Shift several"
      tabIndex={0}
      onScroll={(event) => {
        setTop(event.currentTarget.scrollTop);
        setHeight(event.currentTarget.clientHeight);
      }}
      onKeyDown={(event) => {
        if (event.key === "ArrowDown") step(1, event.shiftKey);
        else if (event.key === "ArrowUp") step(-1, event.shiftKey);
        else if (event.key === "a" && event.ctrlKey) selected.value = new Set(all.map(({ strip }) => strip.id));
        else return;
        event.preventDefault();
      }}
    >
      <div class="row head" role="row">
        {["id", "name", "state", "prio", "window", "tries", "reason"].map((name) => <span key={name} role="columnheader">{name}</span>)}
      </div>
      <div class="rows" style={{ height: `${all.length * ROW}px` }}>
        {part.map(({ strip, change }, i) => <Line key={strip.id} strip={strip} change={change} top={(first + i) * ROW} />)}
      </div>
    </div>
  );
}

function countdown(change: ChangeFact, t: number): string {
  if (!change.close_ms || change.close_ms < t) return "–";
  return change.open_ms > t ? `in ${duration(change.open_ms - t)}` : `closes ${duration(change.close_ms - t)}`;
}

function Line({ strip, change, top }: Row & { top: number }) {
  const look = lookOf(change.state);
  return (
    <div
      class={selected.value.has(strip.id) ? "row selected" : "row"}
      role="row"
      style={{ top: `${top}px` }}
      onClick={(event) => select(strip.id, event.ctrlKey || event.shiftKey)}
    >
      <span role="gridcell">{strip.id}</span>
      <span role="gridcell" title={strip.name}>{strip.name}</span>
      <span role="gridcell" style={{ color: look.colour }}>{look.name}</span>
      <span role="gridcell">{strip.priority.toFixed(2)}</span>
      <span role="gridcell">{countdown(change, shown.value)}</span>
      <span role="gridcell">{change.attempts}</span>
      <span role="gridcell" title={change.reason}>{change.reason}</span>
    </div>
  );
}

function Drawer({ id }: { id: number }) {
  const [report, setReport] = useState<Report | null>(null);
  const strip = world.value.strips.get(id);
  const change = strip && world.value.changeAt(strip, shown.value);
  const live = info.value.live;
  useEffect(() => {
    setReport(null);
    if (live) void told(get<Report>(`/api/strips/${id}`)).then((it) => setReport(it ?? null));
  }, [id, live, change?.n]);
  if (!strip || !change) return null;
  const history = strip.changes.filter(({ t }) => t <= shown.value);
  const link = (name: string, other: number) =>
    other > 0 && <button class="link" onClick={() => select(other)}>{name} {other}</button>;
  return (
    <aside class="drawer" aria-label={`strip ${id}`}>
      <header>
        <b>{id} {strip.name}</b>
        <button aria-label="close" onClick={() => select(0)}>×</button>
      </header>
      <p>
        {lookOf(change.state).name}{change.reason && `: ${change.reason} (reason ${change.reason_code})`} · priority {strip.priority} ·{" "}
        {strip.speed_m_s} m/s · by {strip.submitter || "–"} {link("twin", strip.linked_to)} {link("replaces", strip.supersedes)}{" "}
        {link("replaced by", change.superseded_by)}
      </p>
      <p>
        from {strip.start[1].toFixed(3)}, {strip.start[0].toFixed(3)} to {strip.end[1].toFixed(3)}, {strip.end[0].toFixed(3)}
      </p>
      <table>
        <thead><tr><th>when</th><th>state</th><th>who</th><th>why</th></tr></thead>
        <tbody>
          {history.map((it) => (
            <tr key={it.n}><td>{stamp(it.t)}</td><td>{lookOf(it.state).name}</td><td>{it.actor}</td><td>{it.reason}</td></tr>
          ))}
        </tbody>
      </table>
      {report && <Opportunities list={report.opportunities} />}
    </aside>
  );
}

/** When a strip can be imaged, with what it would take. */
export function Opportunities({ list }: { list: readonly Opportunity[] }) {
  if (!list.length) return <p>no opportunity is left</p>;
  return (
    <table>
      <thead><tr><th>opens</th><th>closes</th><th>elevation</th><th>slew</th><th>conflicts</th></tr></thead>
      <tbody>
        {list.slice(0, 12).map((it) => (
          <tr key={it.open_ms}>
            <td>{stamp(it.open_ms)}</td>
            <td>{clock(it.close_ms)}</td>
            <td>{it.min_elevation_deg.toFixed(1)}°</td>
            <td>{it.transition_ticks === null ? "–" : `${it.transition_ticks} ticks`}</td>
            <td title={it.conflict_ids.join(", ")}>{it.conflicts}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
