// Messages between the modules of a page.
"use strict";

const listeners = new Map();

// Calls `act` with each message of a kind. Of the server: "hello" (once), "state", "rows",
// "error"; of this page: "joined" (each connection), "frame", "picture", "theme", "lost".
export function on(kind, act) {
  if (!listeners.has(kind)) listeners.set(kind, []);
  listeners.get(kind).push(act);
}

export function emit(kind, data) {
  for (const act of listeners.get(kind) ?? []) act(data);
}
