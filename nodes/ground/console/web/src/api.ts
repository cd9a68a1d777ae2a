// Calls to the server, and the stream of facts that comes from it.

import type { Fact } from "./facts";
import { connected, info, locked, message, restart, take, type Info } from "./store";
import { follow, type Told } from "./stream";

export interface Outcome {
  name: string;
  accepted: boolean;
  id: number;
  reason_code: number;
  reason: string;
}

export interface Opportunity {
  open_ms: number;
  close_ms: number;
  min_elevation_deg: number;
  acquire_ticks: number;
  transition_ticks: number | null;
  conflicts: number;
  conflict_ids: number[];
}

export interface Preview {
  name: string;
  reason_code: number;
  reason: string;
  opportunities: Opportunity[];
}

export interface Report {
  opportunities: Opportunity[];
  attempts: { task: number; start: number; state: number; max_error: number; min_elevation_deg: number; reason_code: number; reward: number }[];
  history: { t: number; state: string; reason: string; reason_code: number; actor: string }[];
}

async function answer<T>(response: Response): Promise<T> {
  const body: unknown = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error((body as { detail?: string }).detail ?? `${response.status} ${response.statusText}`);
  return body as T;
}

export async function get<T>(path: string): Promise<T> {
  return answer<T>(await fetch(path));
}

export async function post<T>(path: string, body: unknown): Promise<T> {
  const headers = { "Content-Type": "application/json" };
  return answer<T>(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }));
}

/** Does something and tells when it did not work. */
export async function told<T>(work: Promise<T>): Promise<T | undefined> {
  try {
    return await work;
  } catch (error) {
    message.value = error instanceof Error ? error.message : String(error);
    return undefined;
  }
}

/** Tells what became of each of several requests. */
export function tellOutcomes(done: string, outcomes: readonly Outcome[]): void {
  const refused = outcomes.filter((outcome) => !outcome.accepted);
  const taken = outcomes.length - refused.length;
  const why = refused.slice(0, 5).map((it) => `${it.name || `strip ${it.id}`}: ${it.reason} (reason ${it.reason_code})`);
  message.value = [`${taken} ${done}`, ...(refused.length ? [`${refused.length} refused`, ...why] : [])].join(" · ");
}

function hear(told: Told): void {
  if (told.kind === "facts") take(JSON.parse(told.text) as Fact[]);
  else if (told.kind === "restart") restart();
  else connected.value = told.kind === "open";
}

/** Follows the facts for as long as the page is open, with the other tabs of this browser where it can. */
export async function begin(): Promise<void> {
  const response = await fetch("/api/info");
  if (response.status === 401) {
    locked.value = true;
    return;
  }
  info.value = await answer<Info>(response);
  locked.value = false;
  if (typeof SharedWorker === "undefined") return follow(hear);
  const worker = new SharedWorker(new URL("./shared.ts", import.meta.url), { type: "module", name: info.value.run });
  worker.port.onmessage = (event: MessageEvent<Told>) => hear(event.data);
  addEventListener("pagehide", () => worker.port.postMessage("gone"));
}

/** Hands in a token. */
export async function login(token: string): Promise<void> {
  await post("/api/login", { token });
  await begin();
}
