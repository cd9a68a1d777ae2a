// The planner: what it may do by itself, what it proposes, and what it chose among.

import { post, told } from "./api";
import { info, select, selected, shown, version, world } from "./store";
import { duration } from "./time";
import { lastAt } from "./world";

const MODES = ["autonomous", "approve", "hold"];

export function Planner() {
  version.value;
  const [now, t] = [world.value, shown.value];
  const status = lastAt(now.planner, t);
  const live = info.value.live;
  return (
    <div class="planner">
      <p>
        {status?.planner ?? "no planner has told of itself"}{" "}
        {MODES.map((mode) => (
          <button key={mode} disabled={!live} aria-pressed={status?.mode === mode} onClick={() => void told(post("/api/planner/mode", { mode }))}>
            {mode}
          </button>
        ))}
      </p>
      {status && status.proposal > 0 && (
        <section class="proposal">
          <h3>
            proposal {status.proposal} ({status.proposal_state}): <button class="link" onClick={() => select(status.strip)}>{status.name || status.strip}</button>
          </h3>
          <p>
            {status.t_pre} ticks of transition · window closes in {duration(now.time(status.close) - t)}
            {status.deadline > 0 && ` · decided without an operator in ${duration(now.time(status.deadline) - t)}`}
          </p>
          {live && status.proposal_state === "open" && (
            <p>
              <button class="primary" onClick={() => void told(post("/api/planner/review", { proposal: status.proposal, approve: true }))}>approve</button>
              <button onClick={() => void told(post("/api/planner/review", { proposal: status.proposal, approve: false }))}>reject</button>
            </p>
          )}
        </section>
      )}
      {status?.last_outcome && <p>before: {status.last_outcome}</p>}
      <Candidates />
    </div>
  );
}

function Candidates() {
  const [now, t] = [world.value, shown.value];
  const offer = lastAt(now.offers, t);
  if (!offer) return null;
  const choice = now.choices.get(offer.task);
  const made = choice && choice.t <= t ? choice : undefined;
  const chosen = made?.candidates[made.chosen];
  return (
    <section>
      <h3>task {offer.task}: {offer.candidates.length} candidates, {offer.pending} strips wait</h3>
      {made && (
        <p>
          {made.planner} chose {chosen === undefined ? "to wait" : (now.strips.get(chosen)?.name ?? chosen)} in {(made.compute_s * 1000).toFixed(1)} ms
        </p>
      )}
      <table>
        <thead><tr><th /><th>strip</th><th>priority</th><th>opens in</th><th>closes in</th><th>p</th></tr></thead>
        <tbody>
          {offer.candidates.map(({ strip, open, close }) => {
            const at = made?.candidates.indexOf(strip) ?? -1;
            const probability = made?.probabilities[at];
            return (
              <tr key={strip} class={selected.value.has(strip) ? "selected" : ""} onClick={() => select(strip)}>
                <td>{strip === chosen ? "▶" : ""}</td>
                <td>{now.strips.get(strip)?.name ?? strip}</td>
                <td>{now.strips.get(strip)?.priority.toFixed(2)}</td>
                <td>{duration(now.time(open) - t)}</td>
                <td>{duration(now.time(close) - t)}</td>
                <td>{probability === undefined ? "" : probability.toFixed(2)}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </section>
  );
}
