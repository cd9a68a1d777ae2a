// The planner: what it may do by itself, what it proposes, and what it chose among.

import { post, told } from "./api";
import { info, select, selected, shown, world } from "./store";
import { duration, window } from "./time";
import { lastAt } from "./world";

const MODES = ["autonomous", "approve", "hold"];

export function Planner() {
  const [now, t] = [world.value, shown.value];
  const status = lastAt(now.planner, t);
  const live = info.value.commands;
  return (
    <div class="planner">
      <div class="actions">
        <b>{status?.planner ?? "no planner has told of itself"}</b>
        <span class="space" />
        <span class="group" role="group" aria-label="mode">
          {MODES.map((mode) => (
            <button key={mode} disabled={!live} aria-pressed={status?.mode === mode} onClick={() => void told(post("/api/planner/mode", { mode }))}>
              {mode}
            </button>
          ))}
        </span>
      </div>
      {status && status.proposal > 0 && (
        <section class="proposal">
          <h3>
            proposal {status.proposal} ({status.proposal_state}): <button class="link" onClick={() => select(status.strip)}>{status.name || status.strip}</button>
          </h3>
          <p>
            {(status.t_pre * now.tick_ms / 1000).toFixed(1)} s of transition · window closes in <b class="number">{duration(now.time(status.close) - t)}</b>
            {status.deadline > 0 && <> · decided without an operator in <b class="number">{duration(now.time(status.deadline) - t)}</b></>}
          </p>
          {live && status.proposal_state === "open" && (
            <p>
              <button class="primary" onClick={() => void told(post("/api/planner/review", { proposal: status.proposal, approve: true }))}>approve</button>
              <button onClick={() => void told(post("/api/planner/review", { proposal: status.proposal, approve: false }))}>reject</button>
            </p>
          )}
        </section>
      )}
      {status?.last_outcome && <p class="dim">before: {status.last_outcome}</p>}
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
          {made.planner} chose {chosen === undefined ? "to wait" : (now.strips.get(chosen)?.name ?? chosen)} in {(made.compute_s * 1000).toFixed(1)} ms{made.value ? `, and expects ${made.value.toFixed(2)} from here` : ""}
        </p>
      )}
      <table class="wide">
        <thead><tr><th /><th>strip</th><th>priority</th><th>window</th><th>images for</th>{made && made.probabilities.length > 0 && <th>probability</th>}</tr></thead>
        <tbody>
          {offer.candidates.map(({ strip, open, close, t_acq }) => {
            const at = made?.candidates.indexOf(strip) ?? -1;
            const probability = made?.probabilities[at];
            return (
              <tr key={strip} class={selected.value.has(strip) ? "selected" : strip === chosen ? "chosen" : ""} onClick={() => select(strip)}>
                <td>{strip === chosen ? "▶" : ""}</td>
                <td>{now.strips.get(strip)?.name ?? strip}</td>
                <td>{now.strips.get(strip)?.priority.toFixed(2)}</td>
                <td class="number">{window(now.time(open), now.time(close), t)}</td>
                <td class="number">{(t_acq * now.tick_ms / 1000).toFixed(1)} s</td>
                {probability !== undefined && <td class="number"><meter min={0} max={1} value={probability} /> {probability.toFixed(2)}</td>}
              </tr>
            );
          })}
        </tbody>
      </table>
    </section>
  );
}
