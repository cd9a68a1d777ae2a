// The page: header, map, panels, one time axis.

import { effect, signal } from "@preact/signals";
import { render } from "preact";
import { Alarms, standing } from "./alarms";
import { begin, login, told } from "./api";
import { Link, LinkPill } from "./link";
import { WorldMap } from "./map";
import { Planner } from "./planner";
import { Plots } from "./plots";
import { onlyState, Requests } from "./requests";
import { connected, hasRadio, heard, info, locked, message, panel, shown, wall, world } from "./store";
import "./style.css";
import { COMPLETED, ACCEPTED, EXPIRED, FAILED, HELD } from "./states";
import { Submit } from "./submit";
import { stamp } from "./time";
import { TimeBar, Timeline } from "./timeline";
import { lastAt } from "./world";

/** Silence of a flying mission that is worth a word [ms]. */
const SILENCE = 20000;

/** A panel: who sees it, and in which missions. */
interface Panel {
  name: string;
  commands: boolean;
  show: () => preact.JSX.Element;
  here?: () => boolean;
}

const PANELS: Panel[] = [
  { name: "requests", commands: false, show: Requests },
  { name: "submit", commands: true, show: Submit },
  { name: "planner", commands: false, show: Planner },
  { name: "link", commands: false, show: Link, here: () => hasRadio.value },
  { name: "alarms", commands: false, show: Alarms },
];

function Header() {
  const count = standing();
  const missing = world.value.nodes?.missing ?? [];
  const { live, title, caller } = info.value;
  const silence = live && heard.value > 0 ? wall.value - heard.value : 0;
  return (
    <header class="top">
      <h1>Swath</h1>
      <span class="title">{title}</span>
      <span class={live ? "pill good" : "pill warn"}>{live ? "live" : "replay"}</span>
      <output class="clock" aria-label="simulated time">{stamp(shown.value)} <small>UTC</small></output>
      <Totals />
      <span class="space" />
      {!connected.value && <span class="pill bad" role="status">no connection to the console's server</span>}
      {connected.value && silence > SILENCE && <span class="pill warn" role="status">no news for {Math.round(silence / 1000)} s</span>}
      {missing.length > 0 && <span class="pill bad" role="alert">missing: {missing.join(", ")}</span>}
      {hasRadio.value && <LinkPill />}
      {caller && <span class="dim">{caller}{!info.value.commands && " · looks only"}</span>}
      <button class={count.length ? (count.some((it) => it.level > 1) ? "pill bad" : "pill warn") : "pill"} onClick={() => (panel.value = "alarms")}>
        {count.length} alarm{count.length === 1 ? "" : "s"}
      </button>
    </header>
  );
}

/** How many requests are where it matters; a click shows them. */
function Totals() {
  const summary = lastAt(world.value.summaries, shown.value);
  if (!summary) return null;
  const tile = (name: string, state: number, kind = "") => (
    <button class={`tile ${kind}`} onClick={() => onlyState(state)} title={`show ${name}`}>
      <b>{summary.counts[state]}</b> {name}
    </button>
  );
  return (
    <span class="tiles">
      {tile("imaged", COMPLETED, "done")}
      {tile("accepted", ACCEPTED)}
      {tile("held", HELD, summary.counts[HELD] ? "held" : "")}
      {tile("expired", EXPIRED)}
      {tile("failed", FAILED, summary.counts[FAILED] ? "failed" : "")}
      <span class="tile"><b>{summary.reward.toFixed(2)}</b> reward</span>
    </span>
  );
}

const token = signal("");

function Locked() {
  return (
    <form
      class="locked"
      onSubmit={(event) => {
        event.preventDefault();
        void told(login(token.value));
      }}
    >
      <h1>Swath</h1>
      <label>token <input type="password" autocomplete="current-password" value={token.value} onInput={(event) => (token.value = event.currentTarget.value)} /></label>
      <button class="primary">open</button>
      {message.value && <p class="refused" role="status">{message.value}</p>}
    </form>
  );
}

/** Opens a panel; what was said in another one is over. */
function open(name: string): void {
  if (name === panel.value) return;
  panel.value = name;
  message.value = "";
}

function App() {
  if (locked.value) return <Locked />;
  const panels = PANELS.filter((it) => (info.value.commands || !it.commands) && (it.here?.() ?? true));
  const Shown = (panels.find((it) => it.name === panel.value) ?? panels[0]!).show;
  return (
    <>
      <Header />
      <main>
        <WorldMap />
        <section class="side">
          <nav role="tablist">
            {panels.map(({ name }) => (
              <button key={name} role="tab" aria-selected={panel.value === name} onClick={() => open(name)}>{name}</button>
            ))}
          </nav>
          {message.value && (
            <p class="message" role="status">
              <span>{message.value}</span> <button aria-label="dismiss" onClick={() => (message.value = "")}>×</button>
            </p>
          )}
          <Shown />
        </section>
      </main>
      <footer>
        <TimeBar />
        <Timeline />
        <Plots />
      </footer>
    </>
  );
}

effect(() => {
  const count = standing().length;
  document.title = `${count ? `(${count}) ` : ""}Swath ${info.value.title}`;
});

setInterval(() => (wall.value = Date.now()), 1000);
render(<App />, document.getElementById("app")!);
void told(begin());
