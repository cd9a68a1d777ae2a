// The page: header, map, panels, one time axis.

import { effect, signal } from "@preact/signals";
import { render } from "preact";
import { Alarms, standing } from "./alarms";
import { follow, told } from "./api";
import { WorldMap } from "./map";
import { Planner } from "./planner";
import { Plots } from "./plots";
import { Requests } from "./requests";
import { connected, info, message, shown, version, world } from "./store";
import "./style.css";
import { Submit } from "./submit";
import { TimeBar, Timeline } from "./timeline";
import { lastAt } from "./world";

const panel = signal("requests");

const PANELS: { name: string; live: boolean; show: () => preact.JSX.Element }[] = [
  { name: "requests", live: false, show: Requests },
  { name: "submit", live: true, show: Submit },
  { name: "planner", live: false, show: Planner },
  { name: "alarms", live: false, show: Alarms },
];

function Header() {
  version.value;
  const count = standing().length;
  const summary = lastAt(world.value.summaries, shown.value);
  const missing = world.value.nodes?.missing ?? [];
  return (
    <header class="top">
      <h1>Swath</h1>
      <span>{info.value.title}</span>
      <span class={info.value.live ? "live" : "replay"}>{info.value.live ? "live" : "replay"}</span>
      {summary && (
        <span>
          {summary.counts[6]} imaged · {summary.counts[3]} accepted · {summary.counts[2]} held · reward {summary.reward.toFixed(2)}
        </span>
      )}
      <span class="space" />
      {!connected.value && <span class="error" role="status">no connection to the console's server</span>}
      {missing.length > 0 && <span class="error" role="alert">missing: {missing.join(", ")}</span>}
      <button class={count ? "error" : ""} onClick={() => (panel.value = "alarms")}>{count} alarms</button>
    </header>
  );
}

function App() {
  const panels = PANELS.filter((it) => info.value.live || !it.live);
  const Shown = (panels.find((it) => it.name === panel.value) ?? panels[0]!).show;
  return (
    <>
      <Header />
      <main>
        <WorldMap />
        <section class="side">
          <nav role="tablist">
            {panels.map(({ name }) => (
              <button key={name} role="tab" aria-selected={panel.value === name} onClick={() => (panel.value = name)}>{name}</button>
            ))}
          </nav>
          {message.value && (
            <p class="message" role="status">
              {message.value} <button aria-label="dismiss" onClick={() => (message.value = "")}>×</button>
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

render(<App />, document.getElementById("app")!);
void told(follow());
