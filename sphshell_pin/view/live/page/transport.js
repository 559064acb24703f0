// Run, step, reset, speed.
"use strict";

import { on, send } from "./connection.js";
import { element, number, Slider } from "./controls.js";
import { add_key } from "./keys.js";

let running = null, speed = null, over = false;

const toggle = () => running !== null && send({ type: "run", on: !running });
const step = () => send({ type: "step", seconds: Number(element("step-size").value) });
// Once what the scenario states is over, the same button shows it again.
const reset = () => {
  send({ type: "reset" });
  if (over && !running) toggle();
};

element("run").onclick = toggle;
element("step").onclick = step;
element("reset").onclick = reset;
element("notice").querySelector("button").onclick = reset;
add_key({ keys: [" "], says: "run or pause", act: toggle });
add_key({ keys: ["s", "ArrowRight"], says: "one step", act: step, repeats: true });
add_key({ keys: ["r"], says: "reset: back to the start", act: reset });

on("hello", (data) => {
  speed = new Slider(element("speed"), {
    low: data.speeds[0], high: data.speeds[1], log: true, value: 1, output: element("speed-value"),
    tell: (value) => `${number(value, 3)} \u00d7`,
  }, (value) => send({ type: "speed", value: Math.abs(value - 1) < 0.03 ? 1 : value }));
  on("state", ({ t }) => {
    over = data.planned !== null && t - data.start >= data.planned;
    element("reset").textContent = over ? "Repeat" : "Reset";
  });
});

on("state", (data) => {
  running = data.running;
  element("run").classList.toggle("running", running);
  element("run-word").textContent = running ? "Pause" : "Run";
  speed.follow(data.speed);
});
