// The worker that all tabs share: it follows the facts and keeps them for tabs that come later.

import { follow, type Told } from "./stream";

const ports = new Set<MessagePort>();
let state: Told = { kind: "closed" };
let known: Told[] = [];

follow((told) => {
  if (told.kind === "restart") known = [];
  else if (told.kind === "facts") known.push(told);
  else state = told;
  for (const port of ports) port.postMessage(told);
});

addEventListener("connect", (event) => {
  const port = (event as MessageEvent).ports[0]!;
  // The tab goes.
  port.onmessage = () => ports.delete(port);
  ports.add(port);
  port.postMessage({ kind: "restart" } satisfies Told);
  for (const told of known) port.postMessage(told);
  port.postMessage(state);
});
