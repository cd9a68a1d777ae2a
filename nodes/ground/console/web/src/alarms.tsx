// Alarms: those that count first, with who has seen them and what is put aside; and which nodes are there.

import { signal } from "@preact/signals";
import { post, told } from "./api";
import { info, shown, world } from "./store";
import { clock, stamp } from "./time";
import type { Alarm } from "./world";

/** For how long alarms are put aside [min of simulated time]. */
const minutes = signal(60);
const reason = signal("");

/** Alarms that nobody has acknowledged or put aside. */
export function standing(): Alarm[] {
  const now = world.value;
  return [...now.alarms.values()].filter((alarm) => now.stands(alarm, now.now));
}

export function Alarms() {
  const [now, t] = [world.value, shown.value];
  const stands = (alarm: Alarm) => now.stands(alarm, t);
  const alarms = [...now.alarms.values()]
    .filter((alarm) => alarm.t <= t)
    .sort((a, b) => Number(stands(b)) - Number(stands(a)) || b.level - a.level || b.t - a.t);
  const open = alarms.filter((alarm) => stands(alarm)).map(({ alarm }) => alarm);
  return (
    <div class="alarms">
      <Nodes />
      {info.value.commands && <Actions open={open} />}
      {alarms.length === 0 ? (
        <p class="empty">No alarm has been raised.</p>
      ) : (
        <table class="wide">
          <thead><tr><th>raised</th><th>level</th><th>by</th><th>what</th><th /></tr></thead>
          <tbody>{alarms.map((alarm) => <Line key={alarm.alarm} alarm={alarm} stands={stands(alarm)} t={t} />)}</tbody>
        </table>
      )}
    </div>
  );
}

const acknowledge = (ids: number[]) => void told(post("/api/alarms/acknowledge", { ids }));
const shelve = (ids: number[]) => void told(post("/api/alarms/shelve", { ids, minutes: minutes.value, reason: reason.value }));

function Actions({ open }: { open: number[] }) {
  return (
    <div class="actions">
      <button disabled={!open.length} onClick={() => acknowledge(open)}>acknowledge all {open.length || ""}</button>
      <span class="space" />
      <label>put aside for <input type="number" min={1} max={43200} value={minutes.value} onInput={(event) => (minutes.value = Number(event.currentTarget.value))} /> min</label>
      <input placeholder="because" aria-label="why it is put aside" value={reason.value} onInput={(event) => (reason.value = event.currentTarget.value)} />
    </div>
  );
}

function Line({ alarm, stands, t }: { alarm: Alarm; stands: boolean; t: number }) {
  const severe = alarm.level > 1;
  const aside = alarm.aside && alarm.aside.until_ms > t ? alarm.aside : undefined;
  return (
    <tr class={stands ? "" : "quiet"}>
      <td class="number" title={stamp(alarm.t)}>{clock(alarm.t)}</td>
      <td><span class={stands ? (severe ? "pill bad" : "pill warn") : "pill"}>{alarm.level > 2 ? "critical" : severe ? "error" : "warning"}</span></td>
      <td>{alarm.name}</td>
      <td>
        {alarm.text}{alarm.count > 1 && <span class="dim"> · {alarm.count} times</span>}
        {alarm.returned && <span class="dim"> · no longer so</span>}
        {alarm.acknowledged && <span class="dim"> · seen{alarm.by && ` by ${alarm.by}`}</span>}
        {aside && <span class="dim"> · put aside until {clock(aside.until_ms)} by {aside.actor}{aside.reason && `: ${aside.reason}`}</span>}
      </td>
      <td class="buttons">
        {info.value.commands && stands && (
          <>
            <button onClick={() => acknowledge([alarm.alarm])}>acknowledge</button>
            <button onClick={() => shelve([alarm.alarm])}>put aside</button>
          </>
        )}
      </td>
    </tr>
  );
}

function Nodes() {
  const nodes = world.value.nodes;
  if (!nodes) return null;
  const again = (name: string) => {
    const count = nodes.restarts[name];
    return count ? ` · ${count} restart${count > 1 ? "s" : ""}` : "";
  };
  return (
    <ul class="nodes" aria-label="nodes">
      {nodes.missing.map((name) => <li key={name}><span class="pill bad">✕ {name} is missing</span></li>)}
      {nodes.present.map((name) => <li key={name}><span class="pill good">● {name}{again(name)}</span></li>)}
    </ul>
  );
}
