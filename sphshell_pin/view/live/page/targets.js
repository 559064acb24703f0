// The joint targets of the controller: a slider each, in degrees or m.
"use strict";

import { on, send } from "./connection.js";
import { make_parameter } from "./controls.js";
import { add_section } from "./panel.js";

const MANY = 8; // more are folded away at first
const DEGREE = Math.PI / 180;
const sliders = new Map();

// What is shown is rounded: a value just beyond an end means that end.
function at_limit(value, low, high) {
  const hair = 1e-3 * (high - low);
  if (value > high && value < high + hair) return high;
  return value < low && value > low - hair ? low : value;
}

on("hello", ({ targets }) => {
  if (!targets?.length) return;
  const body = add_section("targets-section", "Joint targets");
  body.parentElement.open = targets.length <= MANY;
  const aim = (joint, value) => send({ type: "target", joint, value });
  for (const { joint, rotates, low, high, limited, value } of targets) {
    const unit = rotates ? DEGREE : 1;
    const { row, slider } = make_parameter({
      key: `target-${joint}`, label: joint, unit: rotates ? "\u00b0" : "m", log: false,
      low: low / unit, high: high / unit, value: value / unit,
    }, (shown) => aim(joint, at_limit(shown * unit, low, high)));
    const text = row.querySelector("label");
    text.title = limited ? `${joint}: the slider ends at its limits` : `${joint}: has no limits`;
    body.append(row);
    sliders.set(joint, { slider, unit });
  }
  const back = document.createElement("button");
  back.textContent = "Targets of the start";
  back.title = "As the scenario has them";
  back.onclick = () => { for (const { joint, value } of targets) aim(joint, value); };
  const buttons = document.createElement("div");
  buttons.className = "buttons";
  buttons.append(back);
  body.append(buttons);
});

on("state", ({ targets }) => {
  for (const [joint, value] of Object.entries(targets ?? {})) {
    const { slider, unit } = sliders.get(joint) ?? {};
    slider?.follow(value / unit);
  }
});
