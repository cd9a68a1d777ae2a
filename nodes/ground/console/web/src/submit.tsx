// Submit: a strip drawn on the map, or a GeoJSON file; first its opportunities, then the submission.

import { signal } from "@preact/signals";
import { post, told, tellOutcomes, type Outcome, type Preview } from "./api";
import { Opportunities } from "./requests";
import { draft, drawing, drawn, message, panel, replaced, select } from "./store";

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
      name: draft.value.name || "drawn",
      client_ref: `console-${Date.now()}`,
      priority: draft.value.priority,
      acquisition_speed_m_s: draft.value.speed,
      hold_for_approval: draft.value.hold,
      bidirectional: draft.value.both,
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
  const old = replaced.value;
  const answer = old ? post<Outcome>(`/api/strips/${old}/replace`, body).then((it) => [it]) : post<Outcome[]>("/api/strips", body);
  const outcomes = await told(answer);
  busy.value = false;
  if (!outcomes) return;
  tellOutcomes(old ? `in the place of ${old}` : "accepted", outcomes);
  leave();
  const first = outcomes.find((it) => it.accepted);
  if (first) {
    panel.value = "requests";
    select(first.id);
  }
}

/** Leaves what was to be submitted. */
function leave(): void {
  previews.value = null;
  file.value = null;
  drawn.value = [];
  drawing.value = false;
  replaced.value = 0;
}

async function take(given: File | undefined): Promise<void> {
  if (!given) return;
  if (given.size > LARGEST) {
    message.value = `${given.name} has ${(given.size / 1e6).toFixed(0)} MB, the limit is ${LARGEST / 1e6} MB`;
    return;
  }
  file.value = { name: given.name, text: await given.text() };
  drawn.value = [];
  replaced.value = 0;
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
      <div class="actions">
        <button aria-pressed={drawing.value} onClick={() => (drawing.value = !drawing.value)}>draw on the map</button>
        <label class="file">
          choose a GeoJSON file
          <input type="file" aria-label="GeoJSON file" accept=".json,.geojson" onChange={(event) => void take(event.currentTarget.files?.[0])} />
        </label>
        <span class="dim">or drop one here</span>
      </div>
      {replaced.value > 0 && <p>in the place of strip <b>{replaced.value}</b></p>}
      {file.value ? <p><b>{file.value.name}</b></p> : <Drawn />}
      <div class="actions">
        <button disabled={!ready} onClick={() => void preview()}>opportunities</button>
        <button disabled={!ready} class="primary" onClick={() => void submit()}>{replaced.value ? "replace" : "submit"}</button>
        {ready && <button onClick={leave}>leave it</button>}
        {busy.value && <span role="status">…</span>}
      </div>
      {previews.value?.map((it, i) => (
        <section key={i} class="preview">
          <h3>{it.name}</h3>
          {it.reason_code ? <p class="refused">would be refused: {it.reason} (reason {it.reason_code})</p> : <Opportunities list={it.opportunities} />}
        </section>
      ))}
    </div>
  );
}

function Drawn() {
  const { name, priority, speed, hold, both } = draft.value;
  const change = (part: Partial<typeof draft.value>) => (draft.value = { ...draft.value, ...part });
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
      <span>{coordinate(0, 1, "from lat", 90)} {coordinate(0, 0, "lon", 180)}</span>
      <span>{coordinate(1, 1, "to lat", 90)} {coordinate(1, 0, "lon", 180)}</span>
      <label>name <input value={name} maxLength={100} onInput={(event) => change({ name: event.currentTarget.value })} /></label>
      <label>priority <input type="number" min={0} max={1} step="any" value={priority} onInput={(event) => change({ priority: Number(event.currentTarget.value) })} /></label>
      <label>speed [m/s] <input type="number" step="any" value={speed} onInput={(event) => change({ speed: Number(event.currentTarget.value) })} /></label>
      <label><input type="checkbox" checked={hold} onChange={(event) => change({ hold: event.currentTarget.checked })} /> hold for approval</label>
      <label><input type="checkbox" checked={both} onChange={(event) => change({ both: event.currentTarget.checked })} /> either direction</label>
    </fieldset>
  );
}
