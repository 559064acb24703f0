// The panel and the connection: it shows the state of the run and sends the user's input.
"use strict";

import { Chart } from "./chart.js";
import { element, make_parameter, number, Slider } from "./controls.js";
import { Picture } from "./scene.js";

const PARTS = {
  robot: "Robot", spheres: "Spheres", arrows: "Force arrows", points: "Contact points",
  trails: "Trails", cones: "Friction cones", wireframe: "Wireframe", patches: "Patch colors",
  distance: "Curved-flat distance",
};
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const RETRY = 1000; // [ms]
const SLOW = 100; // [ms] from a frame to its picture

let hello = null, state = null, socket = null, picture = null, chart = null;
let messages = 0, seen = 0;
const parameters = new Map(), sliders = {}, boxes = new Map();

function send(event) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(event));
}

// Connection

function connect() {
  const address = new URL("socket", document.baseURI);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(address.href);
  socket.binaryType = "arraybuffer";
  messages = seen = 0;
  let ended = false;
  socket.onmessage = (event) => {
    if (typeof event.data !== "string") { draw(event.data); return; }
    const data = JSON.parse(event.data);
    if (data.type === "hello") greet(data);
    else if (data.type === "state") show(data);
    else if (data.type === "rows") { if (chart) chart.add(data.rows, data.clear); }
    else if (data.type === "error") toast(data.text);
    else if (data.type === "end") ended = true;
  };
  socket.onclose = () => {
    notice(ended ? "The run has ended." : "The run is gone; waiting for it to come back.", "lost");
    document.body.classList.add("lost");
    setTimeout(connect, RETRY);
  };
  socket.onopen = () => {
    document.body.classList.remove("lost");
    if (element("notice").dataset.why === "lost") notice(null);
  };
}

function draw(buffer) {
  messages += 1;
  picture?.draw(buffer);
  // The next frame is asked for when this one is on the screen. Where pictures take long, as
  // without a graphics card, as long a rest follows: else the page would not feel the mouse.
  const came = performance.now();
  const answer = () => {
    if (seen < messages) { seen = messages; send({ type: "seen", frame: seen }); }
  };
  requestAnimationFrame(() => {
    const late = performance.now() - came;
    if (late > SLOW) setTimeout(answer, Math.min(late, 900)); else answer();
  });
}

function greet(data) {
  if (hello) {
    if (hello.session !== data.session) location.reload();
    return;
  }
  hello = data;
  for (const [name, ramp] of [["ramp", data.ramp], ["pressure", data.pressure_ramp]])
    element(`${name}-swatch`).style.background = `linear-gradient(90deg, ${ramp.join(", ")})`;
  document.title = data.title;
  element("title").textContent = data.title;
  element("title").title = data.title;
  if (data.picture) {
    const frame = document.createElement("iframe");
    frame.src = data.picture;
    frame.title = "meshcat";
    element("scene").append(frame);
    element("as-seen").remove();
    element("status").style.top = "auto";
    element("status").style.bottom = "12px";
    element("legend").hidden = true;
  } else {
    try {
      picture = new Picture(element("scene"));
    } catch {
      element("as-seen").remove();
      notice("This browser cannot draw the scene: it has no WebGL. All else works.", "blind");
    }
  }
  chart = new Chart(element("chart"), data.colors);
  for (const [name, color] of Object.entries(data.colors)) {
    element(`${name}-swatch`).style.background = color;
  }
  for (const name of ["normal", "friction"]) {
    element(`${name}-key`).style.background = data.colors[name];
  }
  fill(element("pair"), [["", data.pairs.length > 1 ? "all pairs, summed" : "all"],
    ...data.pairs.map((name, index) => [index, name])]);
  element("pair").hidden = data.pairs.length < 2;
  fill(element("body"), data.bodies.map((name) => [name, name]));
  element("push-section").hidden = !data.bodies.length;
  const replay = data.duration !== null;
  element("parameter-section").hidden = replay;
  element("scrub").hidden = !replay;
  if (!data.parameters.length) {
    element("parameters").innerHTML = '<p class="hint">This scenario lists no parameters: add [[knob]] tables to it.</p>';
  }
  for (const parameter of data.parameters) {
    const { row, slider } = make_parameter(parameter, (value) => send({ type: "parameter", key: parameter.key, value }));
    element("parameters").append(row);
    parameters.set(parameter.key, slider);
  }
  sliders.speed = new Slider(element("speed"), {
    low: data.speeds[0], high: data.speeds[1], log: true, value: 1, output: element("speed-value"),
    tell: (value) => `${number(value, 3)} \u00d7`,
  }, (value) => send({ type: "speed", value: Math.abs(value - 1) < 0.03 ? 1 : value }));
  sliders.arrows = new Slider(element("arrows"), {
    low: 0.1, high: 10, log: true, value: 1, output: element("arrows-value"),
    tell: (value) => `${number(value, 2)} \u00d7`,
  }, (value) => send({ type: "arrows", value: Math.abs(value - 1) < 0.03 ? 1 : value }));
  if (replay) {
    element("scrubber").addEventListener("input", () => {
      sliders.scrubbed = performance.now();
      send({ type: "seek", t: data.start + (data.duration * element("scrubber").value) / 10000 });
    });
  }
  document.body.classList.add("ready");
}

function fill(select, options) {
  select.textContent = "";
  for (const [value, text] of options) select.append(new Option(text, value));
}

// What the run says

function show(data) {
  state = data;
  globalThis.state = data;
  element("time").textContent = data.t.toFixed(data.speed < 0.2 ? 5 : 3);
  element("factor").textContent = data.running
    ? data.factor.toFixed(data.factor < 0.1 ? 3 : 2) : "paused";
  element("times").hidden = !data.running;
  element("cone-key").hidden = !data.show.cones;
  element("residual").textContent = number(data.residual, 2);
  element("relative").textContent = data.relative === null
    ? "energy residual" : `residual, ${number(data.relative, 2)} of exchanged`;
  element("run").classList.toggle("running", data.running);
  element("run-word").textContent = data.running ? "Pause" : "Run";
  element("scale").textContent = data.scale;
  element("cut").hidden = !data.cut;
  element("pressure").hidden = !data.pressure;
  element("pressure").lastChild.textContent = data.pressure ?? "";
  element("coloring").hidden = !data.coloring;
  element("coloring").lastChild.textContent = data.coloring ?? "";
  sliders.speed.follow(data.speed);
  sliders.arrows.follow(data.arrows);
  for (const [key, value] of Object.entries(data.parameters)) parameters.get(key)?.follow(value);
  for (const [part, on] of Object.entries(data.show)) {
    const box = boxes.get(part);
    if (box) box.checked = on;
  }
  if (hello.duration !== null) {
    const share = hello.duration > 0 ? (data.t - hello.start) / hello.duration : 0;
    if (!(performance.now() - sliders.scrubbed < 400)) {
      element("scrubber").value = Math.round(10000 * share);
    }
    element("scrub-value").textContent =
      `${(data.t - hello.start).toFixed(3)} / ${hello.duration.toFixed(3)} s`;
  }
  if (data.ended && hello.duration === null) notice(data.ended, "ended");
  else if (element("notice").dataset.why === "ended") notice(null);
  list(data);
  chart.now = data.t;
  chart.span = hello.window * data.speed;
  chart.draw();
}

function list({ contacts, more }) {
  const count = contacts.length + more;
  element("count").textContent = count === 1 ? "1 contact" : `${count} contacts`;
  const body = element("contacts");
  const rows = contacts.map((one) => [
    hello.pairs[one.pair], fixed(one.depth, 4), fixed(one.normal, 3), fixed(one.friction, 3),
    fixed(one.slip, 2), one.motion,
  ]);
  if (!count) rows.push(["nothing touches"]);
  if (more) rows.push([`and ${more} more`]);
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((cells, index) => {
    const row = body.rows[index] || body.insertRow();
    while (row.cells.length > cells.length) row.deleteCell(-1);
    while (row.cells.length < cells.length) row.insertCell();
    row.cells[0].colSpan = cells.length === 1 ? 6 : 1;
    row.cells[0].className = cells.length === 1 ? "none" : "";
    cells.forEach((cell, k) => {
      if (k === 5) mark(row.cells[k], cell);
      else if (row.cells[k].textContent !== cell) row.cells[k].textContent = cell;
    });
    row.cells[0].title = cells[0];
  });
}

const fixed = (value, digits) => (value === null ? "-" : Math.abs(value) >= 1e5
  ? number(value, 3) : value.toFixed(Math.max(0, digits - (Math.abs(value) >= 1000 ? 2 : 0))));

function mark(cell, motion) {
  const word = motion ?? "";
  if (cell.textContent === word) return;
  cell.textContent = "";
  if (!word) return;
  const pill = document.createElement("em");
  pill.className = word;
  pill.textContent = word;
  cell.append(pill);
}

function notice(text, why = "") {
  const node = element("notice");
  node.hidden = text === null;
  node.dataset.why = why;
  node.classList.toggle("bad", why === "ended");
  node.querySelector("span").textContent = text ?? "";
  node.querySelector("button").hidden = why !== "ended";
}

function toast(text) {
  const node = document.createElement("div");
  node.textContent = text;
  element("toasts").append(node);
  while (element("toasts").children.length > 3) element("toasts").firstChild.remove();
  setTimeout(() => node.remove(), 7000);
}

// What the user does

function direction() {
  const chosen = element("direction").value;
  if (!/^[+-]/.test(chosen)) return picture.direction(chosen);
  return AXES[chosen[1]].map((part) => (chosen[0] === "-" ? -part : part));
}

const force = () => ({
  body: element("body").value, direction: direction(), newtons: push_force.value,
});
const toggle = () => state && send({ type: "run", on: !state.running });
const step = () => send({ type: "step", seconds: Number(element("step-size").value) });
const reset = () => send({ type: "reset" });
const push = () => hello?.bodies.length && send({ type: "push", ...force(), seconds: push_time.value });

const push_force = new Slider(element("newtons"), {
  low: 0.01, high: 1000, log: true, value: 5, field: element("newtons-value"),
}, () => {});
const push_time = new Slider(element("seconds"), {
  low: 0.001, high: 10, log: true, value: 0.1, field: element("seconds-value"),
}, () => {});

element("run").onclick = toggle;
element("step").onclick = step;
element("reset").onclick = reset;
element("push").onclick = push;
element("notice").querySelector("button").onclick = reset;
element("look").onclick = () => (hello?.picture ? send({ type: "look" }) : picture?.look());
element("pair").onchange = () => {
  const chosen = element("pair").value;
  chart.pair = chosen === "" ? null : Number(chosen);
  chart.top = 0;
  chart.draw();
};
for (const button of document.querySelectorAll("button")) {
  // Else the space bar would press it again.
  button.addEventListener("click", () => button.blur());
}

const hold = element("hold");
let held = null;
function let_go() {
  if (held === null) return;
  clearInterval(held);
  held = null;
  hold.classList.remove("down");
  send({ type: "release" });
}
hold.addEventListener("pointerdown", (event) => {
  hold.setPointerCapture(event.pointerId);
  hold.classList.add("down");
  const press = () => send({ type: "hold", ...force() });
  press();
  held = setInterval(press, 100); // the direction follows the camera
});
for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
  hold.addEventListener(name, let_go);
}
window.addEventListener("blur", let_go);

for (const [part, label] of Object.entries(PARTS)) {
  const node = document.createElement("label");
  const box = document.createElement("input");
  box.type = "checkbox";
  box.dataset.part = part;
  box.onchange = () => send({ type: "show", part, on: box.checked });
  node.append(box, label);
  element("parts").append(node);
  boxes.set(part, box);
}

const fold = (name) => () => document.body.classList.toggle(name);
element("fold").onclick = element("unfold").onclick = fold("folded");
element("fold-dock").onclick = fold("low");

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const kind = event.target.type;
  if (kind === "text" || event.target.tagName === "SELECT") return;
  if (event.key === "ArrowRight" && kind === "range") return;
  const act = {
    " ": toggle, s: step, ArrowRight: step, r: reset, p: push,
  }[event.key];
  if (!act || (event.repeat && act !== step)) return;
  event.preventDefault();
  act();
});

connect();
