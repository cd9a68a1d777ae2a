// Requests: a table that holds thousands, filters, what can be done to them, and all that is known of one.

import { computed, signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { get, post, told, tellOutcomes, type Opportunity, type Outcome, type Report } from "./api";
import { inView, reveal, view } from "./map";
import { ACCEPTED, HELD, lookOf, STATES } from "./states";
import { draft, drawn, focus, info, panel, replaced, select, selected, shown, world } from "./store";
import { clock, stamp, window } from "./time";
import type { ChangeFact } from "./facts";
import type { Strip } from "./world";

const ROW = 24;
/** Keys that go through the table, and how many rows each. */
const STEPS: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: 20, PageUp: -20, End: Infinity, Home: -Infinity };
/** Rows drawn above and below what is seen. */
const SPARE = 10;

const text = signal("");
const state = signal(-1);
const submitter = signal("");
const onlyInView = signal(false);
const order = signal<"id" | "closes" | "changed">("changed");

interface Row {
  strip: Strip;
  change: ChangeFact;
}

const rows = computed<Row[]>(() => {
  if (onlyInView.value) view.value;
  const [now, t, sought] = [world.value, shown.value, text.value.toLowerCase()];
  const found: Row[] = [];
  for (const strip of now.strips.values()) {
    const change = now.changeAt(strip, t);
    if (!change || (state.value >= 0 && change.state !== state.value)) continue;
    if (sought && !`${strip.id} ${strip.name} ${strip.submitter} ${strip.client_ref}`.toLowerCase().includes(sought)) continue;
    if (submitter.value && strip.submitter !== submitter.value) continue;
    if (onlyInView.value && !inView(strip)) continue;
    found.push({ strip, change });
  }
  const closes = ({ change }: Row) => (change.close_ms > t ? change.close_ms : Infinity);
  if (order.value === "changed") found.sort((a, b) => b.change.t - a.change.t || a.strip.id - b.strip.id);
  else if (order.value === "closes") found.sort((a, b) => (closes(a) < closes(b) ? -1 : closes(a) > closes(b) ? 1 : a.strip.id - b.strip.id));
  return found;
});

const submitters = computed(() => [...new Set([...world.value.strips.values()].map((strip) => strip.submitter))].sort());

/** Shows the requests in one state. */
export function onlyState(wanted: number): void {
  panel.value = "requests";
  text.value = "";
  submitter.value = "";
  state.value = wanted;
}

export function Requests() {
  return (
    <div class="requests">
      <Filters />
      {info.value.commands && <Actions />}
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
        placeholder="number, name"
        aria-label="filter by text"
        value={text.value}
        onInput={(event) => (text.value = event.currentTarget.value)}
      />
      <select aria-label="filter by state" value={state.value} onChange={(event) => (state.value = Number(event.currentTarget.value))}>
        <option value={-1}>every state</option>
        {STATES.map((look, number) => <option key={number} value={number}>{look.name}</option>)}
      </select>
      {submitters.value.length > 1 && (
        <select aria-label="filter by submitter" value={submitter.value} onChange={(event) => (submitter.value = event.currentTarget.value)}>
          <option value="">everybody's</option>
          {submitters.value.map((name) => <option key={name} value={name}>{name}</option>)}
        </select>
      )}
      <select aria-label="order" value={order.value} onChange={(event) => (order.value = event.currentTarget.value as "id")}>
        <option value="changed">last changed</option>
        <option value="closes">closing soon</option>
        <option value="id">number</option>
      </select>
      <label>
        <input type="checkbox" checked={onlyInView.value} onChange={(event) => (onlyInView.value = event.currentTarget.checked)} /> in map view
      </label>
      <span title="requests that are shown">{rows.value.length}</span>
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
  const step = (table: HTMLElement, by: number, more: boolean) => {
    const at = all.findIndex(({ strip }) => strip.id === focus.value);
    const to = Math.max(0, Math.min(all.length - 1, at + by));
    const next = all[to];
    if (!next) return;
    select(next.strip.id, more);
    reveal(next.strip);
    // The head stays above the rows.
    const room = table.clientHeight - ROW;
    table.scrollTop = Math.min(to * ROW, Math.max(table.scrollTop, (to + 1) * ROW - room));
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
        const by = STEPS[event.key];
        if (by) step(event.currentTarget, by, event.shiftKey);
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

function Line({ strip, change, top }: Row & { top: number }) {
  const look = lookOf(change.state);
  return (
    <div
      class={selected.value.has(strip.id) ? "row selected" : "row"}
      role="row"
      style={{ top: `${top}px` }}
      onClick={(event) => {
        select(strip.id, event.ctrlKey || event.shiftKey);
        reveal(strip);
      }}
    >
      <span role="gridcell">{strip.id}</span>
      <span role="gridcell" title={strip.name}>{strip.name}</span>
      <span role="gridcell" style={{ color: look.colour }}>{look.name}</span>
      <span role="gridcell">{strip.priority.toFixed(2)}</span>
      <span role="gridcell">{change.close_ms > shown.value ? window(change.open_ms, change.close_ms, shown.value) : "–"}</span>
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
        <span style={{ color: lookOf(change.state).colour }}>{lookOf(change.state).name}</span>
        <span class="space" />
        {info.value.commands && (
          <>
            <button onClick={() => again(strip, 0)}>clone</button>
            <button disabled={change.state !== ACCEPTED && change.state !== HELD} onClick={() => again(strip, id)}>replace</button>
          </>
        )}
        <button aria-label="close" onClick={() => select(0)}>×</button>
      </header>
      {change.reason && <p class="why">{change.reason} <span class="dim">(reason {change.reason_code})</span></p>}
      <dl>
        <dt>priority</dt><dd>{strip.priority.toFixed(2)}</dd>
        <dt>speed</dt><dd>{strip.speed_m_s.toFixed(0)} m/s</dd>
        <dt>attempts</dt><dd>{change.attempts}</dd>
        <dt>by</dt><dd>{strip.submitter || "–"}{strip.client_ref && ` · ${strip.client_ref}`}</dd>
        <dt>from</dt><dd>{place(strip.start)}</dd>
        <dt>to</dt><dd>{place(strip.end)}</dd>
      </dl>
      <p>{link("twin", strip.linked_to)} {link("replaces", strip.supersedes)} {link("replaced by", change.superseded_by)}</p>
      <table>
        <thead><tr><th>when</th><th>state</th><th>who</th><th>why</th></tr></thead>
        <tbody>
          {history.map((it) => (
            <tr key={it.n}><td class="number" title={stamp(it.t)}>{stamp(it.t).slice(5)}</td><td>{lookOf(it.state).name}</td><td>{it.actor}</td><td>{it.reason}</td></tr>
          ))}
        </tbody>
      </table>
      {report && report.attempts.length > 0 && <Attempts list={report.attempts} />}
      {report && <Opportunities list={report.opportunities} />}
    </aside>
  );
}

const place = ([lon, lat]: [number, number]) =>
  `${Math.abs(lat).toFixed(3)}° ${lat < 0 ? "S" : "N"}, ${Math.abs(lon).toFixed(3)}° ${lon < 0 ? "W" : "E"}`;

/** Fills a new strip with what a known one is. */
function again(strip: Strip, id: number): void {
  drawn.value = [strip.start, strip.end];
  draft.value = { name: strip.name, priority: strip.priority, speed: strip.speed_m_s, hold: false, both: strip.linked_to > 0 };
  replaced.value = id;
  panel.value = "submit";
}

function Attempts({ list }: { list: Report["attempts"] }) {
  return (
    <table>
      <thead><tr><th>attempt</th><th>began</th><th>error</th><th>elevation</th><th>reward</th></tr></thead>
      <tbody>
        {list.map((it) => (
          <tr key={it.task}>
            <td>task {it.task}</td>
            <td>{clock(world.value.time(it.start))}</td>
            <td class="number">{it.max_error.toFixed(4)}</td>
            <td class="number">{it.min_elevation_deg.toFixed(1)}°</td>
            <td class="number">{it.reward.toFixed(2)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** When a strip can be imaged, with what it would take. */
export function Opportunities({ list }: { list: readonly Opportunity[] }) {
  if (!list.length) return <p class="dim">no opportunity is left</p>;
  return (
    <table>
      <thead><tr><th>opens</th><th>closes</th><th>elevation</th><th>slew</th><th>conflicts</th></tr></thead>
      <tbody>
        {list.slice(0, 12).map((it) => (
          <tr key={it.open_ms}>
            <td>{stamp(it.open_ms)}</td>
            <td>{clock(it.close_ms)}</td>
            <td>{it.min_elevation_deg.toFixed(1)}°</td>
            <td>{it.transition_ticks === null ? "–" : `${((it.transition_ticks * world.value.tick_ms) / 1000).toFixed(1)} s`}</td>
            <td title={it.conflict_ids.join(", ")}>{it.conflicts}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
