// The thirteen states of a request: names, and how they look, also to eyes that see fewer colours (Okabe and Ito's palette, and dashes).

export interface StateLook {
  name: string;
  colour: string;
  dash: number[];
  width: number;
}

export const ACCEPTED = 3;
export const HELD = 2;
export const EXECUTING = 5;
export const COMPLETED = 6;
export const EXPIRED = 9;
export const FAILED = 10;

export const STATES: StateLook[] = [
  { name: "received", colour: "#b0b8c0", dash: [2, 2], width: 1.5 },
  { name: "rejected", colour: "#cc79a7", dash: [1, 3], width: 1.5 },
  { name: "held", colour: "#e69f00", dash: [6, 3], width: 2 },
  { name: "accepted", colour: "#56b4e9", dash: [], width: 1.5 },
  { name: "scheduled", colour: "#f0e442", dash: [], width: 3 },
  { name: "executing", colour: "#ffffff", dash: [], width: 4 },
  { name: "completed", colour: "#17b88a", dash: [], width: 2.5 },
  { name: "cancelled by user", colour: "#8a8f98", dash: [1, 4], width: 1.5 },
  { name: "cancelled by system", colour: "#8a8f98", dash: [3, 4], width: 1.5 },
  { name: "expired", colour: "#a08a70", dash: [2, 4], width: 1.5 },
  { name: "failed", colour: "#d55e00", dash: [6, 2], width: 2.5 },
  { name: "superseded", colour: "#6c7a89", dash: [1, 2], width: 1.5 },
  { name: "fulfilled by link", colour: "#17b88a", dash: [4, 3], width: 2 },
];

const UNKNOWN: StateLook = { name: "unknown", colour: "#ff00ff", dash: [], width: 1 };

export const lookOf = (state: number): StateLook => STATES[state] ?? UNKNOWN;
