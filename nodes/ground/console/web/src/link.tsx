// The radio: whether it is open, what waits for it, what is known through it, the passes; and what the ground predicts.

import type { LinkFact, Pass, PlanFact } from "./facts";
import { standingAt } from "./radio";
import { panel, select, selected, shown, world } from "./store";
import { clock, duration, stamp } from "./time";
import { lastAt } from "./world";

/** Tasks of the plan that are listed. */
const LISTED = 50;

const counted = (count: number, what: string): string => `${count} ${what}${count === 1 ? "" : "s"}`;

/** In the header: the radio in a word. */
export function LinkPill() {
  const t = shown.value;
  const standing = standingAt(world.value, t);
  if (!standing) return null;
  const { open, next } = standing;
  return (
    <button class={open ? "pill good" : "pill"} onClick={() => (panel.value = "link")}>
      {open ? "● link open" : `○ link closed${next ? `, pass in ${duration(next.rise_ms - t)}` : ""}`}
    </button>
  );
}

export function Link() {
  const [now, t] = [world.value, shown.value];
  const standing = standingAt(now, t);
  if (!standing) return <div class="link-panel"><p class="empty">Nothing had been told of the radio yet.</p></div>;
  const { told, open, under, next } = standing;
  return (
    <div class="link-panel">
      <h3>
        <span class={open ? "pill good" : "pill warn"}>{open ? "● open" : "○ closed"}</span> told of {duration(t - told.t)} ago
      </h3>
      {open && under && <p>over <b>{under.station}</b> for <b class="number">{duration(under.set_ms - t)}</b>, up to {under.elevation_deg.toFixed(0)}°</p>}
      {next ? (
        <p>next pass in <b class="number">{duration(next.rise_ms - t)}</b> over <b>{next.station}</b>: {clock(next.rise_ms)} to {clock(next.set_ms)}, up to {next.elevation_deg.toFixed(0)}°</p>
      ) : (
        told.passes.length === 0 && <p class="dim">{open ? "It does not wait for passes." : "No pass is left."}</p>
      )}
      <Counts told={told} t={t} />
      <Passes passes={told.passes.filter((it) => it.set_ms > t)} t={t} />
      <Plan plan={lastAt(now.plans, t)} />
    </div>
  );
}

function Counts({ told, t }: { told: LinkFact; t: number }) {
  const age = told.housekeeping === null ? undefined : t - world.value.time(told.housekeeping);
  return (
    <dl>
      <dt>waiting</dt><dd>{counted(told.waiting_orders, "order")}, {counted(told.waiting_changes, "change")}</dd>
      <dt>on board</dt><dd>{told.on_board}</dd>
      <dt>imaged</dt><dd>{told.imaged}</dd>
      <dt>images down</dt><dd>{told.delivered}</dd>
      <dt>frames</dt><dd title="sent · heard whole · heard damaged">{told.frames_sent} · {told.frames_heard} · {told.frames_damaged}</dd>
      <dt>housekeeping</dt><dd class="number">{age === undefined ? "none yet" : `${duration(age)} old`}</dd>
      {age !== undefined && <><dt>then on board</dt><dd>task {told.housekeeping_task}: {told.housekeeping_pending} to image, {told.housekeeping_imaged} imaged</dd></>}
    </dl>
  );
}

function Passes({ passes, t }: { passes: Pass[]; t: number }) {
  if (passes.length === 0) return null;
  return (
    <table class="wide" aria-label="passes">
      <thead><tr><th>pass over</th><th>rises</th><th>sets</th><th>in</th><th>up to</th></tr></thead>
      <tbody>
        {passes.map((pass) => (
          <tr key={`${pass.station} ${pass.rise_ms}`} class={pass.rise_ms <= t ? "chosen" : ""}>
            <td>{pass.station}</td>
            <td class="number" title={stamp(pass.rise_ms)}>{clock(pass.rise_ms)}</td>
            <td class="number" title={stamp(pass.set_ms)}>{clock(pass.set_ms)}</td>
            <td class="number">{pass.rise_ms <= t ? "now" : duration(pass.rise_ms - t)}</td>
            <td class="number">{pass.elevation_deg.toFixed(0)}°</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function Plan({ plan }: { plan: PlanFact | undefined }) {
  if (!plan) return null;
  const [now, t] = [world.value, shown.value];
  const ahead = plan.tasks.filter((task) => now.time(task.end) >= t);
  const more = Math.max(0, ahead.length - LISTED) + plan.left_out;
  return (
    <section aria-label="predicted plan">
      <h3>predicted plan, {duration(t - plan.t)} old</h3>
      <p>
        <b>{plan.equal}</b> of <b>{plan.compared}</b> tasks known were exactly as predicted; {plan.foretold} of {plan.imaged} strips imaged within two minutes
      </p>
      {plan.partings > 0 && <p class="dim">flight and plan have parted {counted(plan.partings, "time")}, last at task {plan.parted_task} ({clock(now.time(plan.parted))}): {plan.parted_reason}</p>}
      <table class="wide">
        <thead><tr><th>task</th><th>strip</th><th>images at</th><th>in</th><th>known at</th></tr></thead>
        <tbody>
          {ahead.slice(0, LISTED).map((task) => (
            <tr key={task.task} class={selected.value.has(task.strip) ? "selected" : ""}>
              <td class="number">{task.task}</td>
              <td><button class="link" onClick={() => select(task.strip)}>{now.strips.get(task.strip)?.name ?? task.strip}</button></td>
              <td class="number" title={stamp(now.time(task.imaging))}>{clock(now.time(task.imaging))}</td>
              <td class="number">{now.time(task.imaging) > t ? duration(now.time(task.imaging) - t) : "now"}</td>
              <td class="number">{!task.success ? "fails" : task.known ? clock(now.time(task.known)) : "later"}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {more > 0 && <p class="dim">and {more} more</p>}
    </section>
  );
}
