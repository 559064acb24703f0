// The connection with the run: messages of the server, and local ones between the modules.
"use strict";

import { emit } from "./events.js";

export { emit, on } from "./events.js";

const RETRY = 1000; // [ms]
const SLOW = 100; // [ms] from a frame to its picture
let socket = null, session = null;
let frames = 0, seen = 0;

export function send(event) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(event));
}

export function connect() {
  const address = new URL("socket", document.baseURI);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(address.href);
  socket.binaryType = "arraybuffer";
  frames = seen = 0;
  let ended = false;
  socket.onmessage = (event) => {
    if (typeof event.data !== "string") { show(event.data); return; }
    const data = JSON.parse(event.data);
    if (data.type === "hello") greet(data);
    else if (data.type === "end") ended = true;
    else emit(data.type, data);
  };
  socket.onclose = () => {
    document.body.classList.add("lost");
    emit("lost", ended ? "The run has ended." : "The run is gone; waiting for it to come back.");
    setTimeout(connect, RETRY);
  };
}

function greet(data) {
  if (session !== null && session !== data.session) { location.reload(); return; }
  document.body.classList.remove("lost");
  if (session === null) {
    session = data.session;
    emit("hello", data);
    document.body.classList.add("ready");
  }
  emit("joined", data);
}

function show(buffer) {
  frames += 1;
  emit("frame", buffer);
  // The next frame is asked for when this one is on the screen. Where pictures take long, as
  // without a graphics card, as long a rest follows: else the page would not feel the mouse.
  const came = performance.now();
  const answer = () => {
    if (seen < frames) { seen = frames; send({ type: "seen", frame: seen }); }
  };
  requestAnimationFrame(() => {
    const late = performance.now() - came;
    if (late > SLOW) setTimeout(answer, Math.min(late, 900)); else answer();
  });
}
