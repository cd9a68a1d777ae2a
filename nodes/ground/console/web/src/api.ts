// Calls to the server, and the stream of facts that comes from it.

import type { Fact } from "./facts";
import { connected, info, message, restart, take, type Info } from "./store";

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
  acquire_s: number;
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
  attempts: { task: number; state: string; max_error: number; min_elevation_deg: number; reason_code: number }[];
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

/** Follows the facts for as long as the page is open; the browser connects again by itself, where it was. */
export async function follow(): Promise<void> {
  info.value = await get<Info>("/api/info");
  const source = new EventSource("/api/facts");
  source.onopen = () => (connected.value = true);
  source.onerror = () => (connected.value = false);
  source.addEventListener("restart", () => restart());
  source.addEventListener("facts", (event) => take(JSON.parse((event as MessageEvent<string>).data) as Fact[]));
}
