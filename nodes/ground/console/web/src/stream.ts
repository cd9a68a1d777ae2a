// The stream of facts, once for all tabs of a browser: HTTP/1.1 allows it six connections to a server.

/** What tabs are told: the connection's state, that numbers begin anew, and facts as JSON. */
export type Told = { kind: "open" } | { kind: "closed" } | { kind: "restart" } | { kind: "facts"; text: string };

/** How long to wait before a server that has refused is asked again [ms]. */
const PAUSE = 3000;

/** Follows the facts; the browser connects again by itself, where it was, unless the server refuses. */
export function follow(tell: (told: Told) => void): void {
  const source = new EventSource("/api/facts");
  source.onopen = () => tell({ kind: "open" });
  source.onerror = () => {
    tell({ kind: "closed" });
    if (source.readyState === EventSource.CLOSED) setTimeout(() => follow(tell), PAUSE);
  };
  source.addEventListener("restart", () => tell({ kind: "restart" }));
  source.addEventListener("facts", (event) => tell({ kind: "facts", text: (event as MessageEvent<string>).data }));
}
