// What the server tells: one record a fact, numbered from 1, never changed afterwards. Times are ms since 1970 UTC of simulated time.

export interface Head {
  n: number;
  t: number;
}

export interface ClockFact extends Head {
  kind: "clock";
  epoch_ms: number;
  tick_ms: number;
}

export interface StripFact extends Head {
  kind: "strip";
  id: number;
  name: string;
  submitter: string;
  client_ref: string;
  start: [number, number];
  end: [number, number];
  priority: number;
  speed_m_s: number;
  linked_to: number;
  supersedes: number;
}

export interface ChangeFact extends Head {
  kind: "change";
  strip: number;
  state: number;
  reason_code: number;
  reason: string;
  actor: string;
  attempts: number;
  reward: number;
  open_ms: number;
  close_ms: number;
  imaging_ms: number;
  superseded_by: number;
}

export interface RefusedFact extends Head {
  kind: "refused";
  name: string;
  submitter: string;
  reason_code: number;
  reason: string;
}

export interface PointFact extends Head {
  kind: "point";
  lon: number;
  lat: number;
  altitude_m: number;
}

export interface StatusFact extends Head {
  kind: "status";
  task: number;
  phase: number;
  strip: number;
  error: number;
  elevation_deg: number;
  remaining: number;
}

export interface WheelsFact extends Head {
  kind: "wheels";
  rpm: number[];
  torque_nm: number[];
}

export interface TaskFact extends Head {
  kind: "task";
  task: number;
  start: number;
  strip: number;
  t_pre: number;
  t_acq: number;
  wait: number;
}

export interface ResultFact extends Head {
  kind: "result";
  task: number;
  start: number;
  end: number;
  strip: number;
  name: string;
  t_pre: number;
  success: boolean;
  reason: number;
  max_error: number;
  min_elevation_deg: number;
  reward: number;
}

export interface OfferFact extends Head {
  kind: "offer";
  task: number;
  candidates: { strip: number; open: number; close: number; t_acq: number }[];
  pending: number;
  fulfilled: number;
}

export interface ChoiceFact extends Head {
  kind: "choice";
  task: number;
  planner: string;
  candidates: number[];
  probabilities: number[];
  value: number;
  chosen: number;
  t_pre: number;
  compute_s: number;
}

export interface PlannerFact extends Head {
  kind: "planner";
  mode: string;
  planner: string;
  proposal_state: string;
  proposal: number;
  strip: number;
  name: string;
  t_pre: number;
  close: number;
  deadline: number;
  last_outcome: string;
}

export interface SummaryFact extends Head {
  kind: "summary";
  counts: number[];
  reward: number;
}

export interface AlarmFact extends Head {
  kind: "alarm";
  alarm: number;
  name: string;
  level: number;
  text: string;
}

export interface ReturnedFact extends Head {
  kind: "returned";
  alarm: number;
}

export interface AcknowledgedFact extends Head {
  kind: "acknowledged";
  alarm: number;
  actor: string;
}

export interface ShelvedFact extends Head {
  kind: "shelved";
  alarm: number;
  until_ms: number;
  actor: string;
  reason: string;
}

export interface NodesFact extends Head {
  kind: "nodes";
  present: string[];
  missing: string[];
  /** How often each was started anew; not those that never were. */
  restarts: Record<string, number>;
}

export interface Pass {
  station: string;
  rise_ms: number;
  set_ms: number;
  elevation_deg: number;
}

export interface LinkFact extends Head {
  kind: "link";
  open: boolean;
  waiting_orders: number;
  waiting_changes: number;
  on_board: number;
  imaged: number;
  delivered: number;
  frames_sent: number;
  frames_heard: number;
  frames_damaged: number;
  /** Tick on board that housekeeping tells of. */
  housekeeping: number | null;
  housekeeping_task: number;
  housekeeping_pending: number;
  housekeeping_imaged: number;
  passes: Pass[];
}

export interface Planned {
  task: number;
  strip: number;
  start: number;
  imaging: number;
  end: number;
  success: boolean;
  known: number;
}

export interface PlanFact extends Head {
  kind: "plan";
  since: number;
  until: number;
  tasks: Planned[];
  left_out: number;
  compared: number;
  equal: number;
  imaged: number;
  foretold: number;
  partings: number;
  parted_task: number;
  parted: number;
  parted_reason: string;
}

/** As the simulator has it; shares are of 1. */
export interface ResourcesFact extends Head {
  kind: "resources";
  battery: number;
  illumination: number;
  generated_w: number;
  load_w: number;
  storage: number;
  to_send_bits: number;
  in_contact: boolean;
  momentum_nms: number;
  /** None where nobody has said what its limit is. */
  momentum: number | null;
  safe_mode: string;
}

export type Fact =
  | ClockFact
  | StripFact
  | ChangeFact
  | RefusedFact
  | PointFact
  | StatusFact
  | WheelsFact
  | TaskFact
  | ResultFact
  | OfferFact
  | ChoiceFact
  | PlannerFact
  | SummaryFact
  | AlarmFact
  | ReturnedFact
  | AcknowledgedFact
  | ShelvedFact
  | NodesFact
  | LinkFact
  | PlanFact
  | ResourcesFact;
