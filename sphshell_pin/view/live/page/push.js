// Pushes: once, or for as long as the button is held.
"use strict";

import { on, send } from "./connection.js";
import { element, fill, Slider } from "./controls.js";
import { add_key } from "./keys.js";

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const HELD = 0.3; // [s of the clock] that a held push outlasts the last message
let picture = null, bodies = [], speed = 1;

on("picture", (one) => { picture = one; });
on("state", (data) => { speed = data.speed; });
on("hello", (data) => {
  bodies = data.bodies;
  fill(element("body"), bodies.map((name) => [name, name]));
  element("push-section").hidden = !bodies.length;
  if (!picture) element("as-seen").remove();
});

function direction() {
  const chosen = element("direction").value;
  if (!/^[+-]/.test(chosen)) return picture.direction(chosen);
  return AXES[chosen[1]].map((part) => (chosen[0] === "-" ? -part : part));
}

const newtons = new Slider(element("newtons"), {
  low: 0.01, high: 1000, log: true, value: 5, field: element("newtons-value"),
}, () => {});
const seconds = new Slider(element("seconds"), {
  low: 0.001, high: 10, log: true, value: 0.1, field: element("seconds-value"),
}, () => {});
const force = () => ({
  body: element("body").value, direction: direction(), newtons: newtons.value,
});
const push = () => bodies.length && send({ type: "push", ...force(), seconds: seconds.value });
element("push").onclick = push;
add_key({ keys: ["p"], says: "push once", act: push });

const hold = element("hold");
let held = null;
function let_go() {
  if (held === null) return;
  clearInterval(held);
  held = null;
  hold.classList.remove("down");
  send({ type: "push", ...force(), newtons: 0, seconds: 0 });
}
function press() {
  if (held !== null) return;
  hold.classList.add("down");
  const again = () => send({ type: "push", ...force(), seconds: HELD * speed });
  again();
  held = setInterval(again, 100); // the direction follows the camera
}
hold.addEventListener("pointerdown", (event) => {
  hold.setPointerCapture(event.pointerId);
  press();
});
hold.addEventListener("keydown", (event) => { if (" Enter".includes(event.key)) press(); });
for (const name of ["pointerup", "pointercancel", "lostpointercapture", "keyup", "blur"]) {
  hold.addEventListener(name, let_go);
}
window.addEventListener("blur", let_go);
