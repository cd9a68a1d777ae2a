// Submit: a strip drawn on the map, or a GeoJSON file; first its opportunities, then the submission.

import { signal } from "@preact/signals";
import { post, told, tellOutcomes, type Outcome, type Preview } from "./api";
import { Opportunities } from "./requests";
import { drawing, drawn, message } from "./store";

interface Feature {
  type: "Feature";
  properties: Record<string, unknown>;
  geometry: { type: "LineString"; coordinates: [number, number][] };
}

/** Largest file that is read [B]; the server takes no larger one. */
const LARGEST = 20e6;

const file = signal<{ name: string; text: string } | null>(null);
const previews = signal<Preview[] | null>(null);
const busy = signal(false);
const name = signal("");
const priority = signal(0.5);
const speed = signal(3000);
const hold = signal(false);
const both = signal(false);

/** What is to be submitted, as GeoJSON; nothing without a file or a strip. */
function order(): { name: string; geojson: unknown } | undefined {
  if (file.value) {
    try {
      return { name: file.value.name, geojson: JSON.parse(file.value.text) };
    } catch (error) {
      message.value = `${file.value.name} is no JSON: ${String(error)}`;
      return undefined;
    }
  }
  if (drawn.value.length < 2) return undefined;
  const feature: Feature = {
    type: "Feature",
    properties: {
      name: name.value || "drawn",
      client_ref: `console-${Date.now()}`,
      priority: priority.value,
      acquisition_speed_m_s: speed.value,
      hold_for_approval: hold.value,
      bidirectional: both.value,
    },
    geometry: { type: "LineString", coordinates: drawn.value.map(([lon, lat]) => [lon, lat]) },
  };
  return { name: "console", geojson: { type: "FeatureCollection", features: [feature] } };
}

async function preview(): Promise<void> {
  const body = order();
  if (!body) return;
  busy.value = true;
  previews.value = (await told(post<Preview[]>("/api/strips/preview", body))) ?? null;
  busy.value = false;
}

async function submit(): Promise<void> {
  const body = order();
  if (!body) return;
  busy.value = true;
  const outcomes = await told(post<Outcome[]>("/api/strips", body));
  busy.value = false;
  if (!outcomes) return;
  tellOutcomes("accepted", outcomes);
  previews.value = null;
  file.value = null;
  drawn.value = [];
  drawing.value = false;
}

async function take(given: File | undefined): Promise<void> {
  if (!given) return;
  if (given.size > LARGEST) {
    message.value = `${given.name} has ${(given.size / 1e6).toFixed(0)} MB, the limit is ${LARGEST / 1e6} MB`;
    return;
  }
  file.value = { name: given.name, text: await given.text() };
  drawn.value = [];
  await preview();
}

export function Submit() {
  const ready = !busy.value && (file.value !== null || drawn.value.length >= 2);
  return (
    <div
      class="submit"
      onDragOver={(event) => event.preventDefault()}
      onDrop={(event) => {
        event.preventDefault();
        void take(event.dataTransfer?.files[0]);
      }}
    >
      <p>
        <button aria-pressed={drawing.value} onClick={() => (drawing.value = !drawing.value)}>draw on the map</button> two clicks, start and
        end; or drop a GeoJSON file here, or{" "}
        <input type="file" aria-label="GeoJSON file" accept=".json,.geojson" onChange={(event) => void take(event.currentTarget.files?.[0])} />
      </p>
      {file.value ? <p>{file.value.name} <button onClick={() => (file.value = null)}>leave it</button></p> : <Drawn />}
      <p>
        <button disabled={!ready} onClick={() => void preview()}>opportunities</button>
        <button disabled={!ready} class="primary" onClick={() => void submit()}>submit</button>
        {busy.value && " …"}
      </p>
      {previews.value?.map((it, i) => (
        <section key={i}>
          <h3>{it.name}</h3>
          {it.reason_code ? <p class="refused">would be refused: {it.reason} (reason {it.reason_code})</p> : <Opportunities list={it.opportunities} />}
        </section>
      ))}
    </div>
  );
}

function Drawn() {
  const coordinate = (end: number, axis: 0 | 1, label: string, limit: number) => (
    <label>
      {label}
      <input
        type="number"
        step="any"
        min={-limit}
        max={limit}
        value={drawn.value[end]?.[axis].toFixed(4) ?? ""}
        onChange={(event) => {
          const value = Number(event.currentTarget.value);
          const next: [number, number][] = [0, 1].map((i) => [...(drawn.value[i] ?? drawn.value[0] ?? [0, 0])]);
          next[end]![axis] = value;
          drawn.value = next;
        }}
      />
    </label>
  );
  return (
    <fieldset>
      <legend>strip</legend>
      {coordinate(0, 1, "from lat", 90)} {coordinate(0, 0, "lon", 180)} {coordinate(1, 1, "to lat", 90)} {coordinate(1, 0, "lon", 180)}
      <label>name <input value={name.value} maxLength={100} onInput={(event) => (name.value = event.currentTarget.value)} /></label>
      <label>priority <input type="number" min={0} max={1} step={0.05} value={priority.value} onInput={(event) => (priority.value = Number(event.currentTarget.value))} /></label>
      <label>speed [m/s] <input type="number" step={100} value={speed.value} onInput={(event) => (speed.value = Number(event.currentTarget.value))} /></label>
      <label><input type="checkbox" checked={hold.value} onChange={(event) => (hold.value = event.currentTarget.checked)} /> hold for approval</label>
      <label><input type="checkbox" checked={both.value} onChange={(event) => (both.value = event.currentTarget.checked)} /> either direction</label>
    </fieldset>
  );
}
