// Alarms: those that nobody has acknowledged first; and which nodes are there.

import { post, told } from "./api";
import { info, shown, version, world } from "./store";
import { stamp } from "./time";
import type { Alarm } from "./world";

/** Alarms that have been raised and that nobody has acknowledged. */
export function standing(): Alarm[] {
  version.value;
  return [...world.value.alarms.values()].filter((alarm) => !alarm.acknowledged);
}

export function Alarms() {
  version.value;
  const alarms = [...world.value.alarms.values()]
    .filter((alarm) => alarm.t <= shown.value)
    .sort((a, b) => Number(a.acknowledged) - Number(b.acknowledged) || b.t - a.t);
  const open = alarms.filter((alarm) => !alarm.acknowledged).map(({ alarm }) => alarm);
  const acknowledge = (ids: number[]) => void told(post("/api/alarms/acknowledge", { ids }));
  const nodes = world.value.nodes;
  return (
    <div class="alarms">
      {info.value.live && <p><button disabled={!open.length} onClick={() => acknowledge(open)}>acknowledge all</button></p>}
      {alarms.length === 0 && <p>no alarm has been raised</p>}
      <ul>
        {alarms.map((alarm) => (
          <li key={alarm.alarm} class={alarm.acknowledged ? "quiet" : alarm.level > 1 ? "error" : "warn"}>
            <b>{alarm.level > 1 ? "error" : "warning"}</b> {stamp(alarm.t)} {alarm.name}: {alarm.text}
            {alarm.count > 1 && ` (${alarm.count} times)`}{" "}
            {info.value.live && !alarm.acknowledged && <button onClick={() => acknowledge([alarm.alarm])}>acknowledge</button>}
          </li>
        ))}
      </ul>
      {nodes && (
        <section>
          <h3>nodes</h3>
          <ul>
            {nodes.missing.map((name) => <li key={name} class="error">{name} is missing</li>)}
            {nodes.present.map((name) => <li key={name}>{name}</li>)}
          </ul>
        </section>
      )}
    </div>
  );
}
