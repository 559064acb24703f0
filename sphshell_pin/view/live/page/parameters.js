// The sliders of the scenario's parameters.
"use strict";

import { on, send } from "./connection.js";
import { element, make_parameter } from "./controls.js";

const sliders = new Map();

on("hello", (data) => {
  if (!data.parameters.length) {
    element("parameters").innerHTML = '<p class="hint">This scenario lists no parameters: add [[knob]] tables to it.</p>';
  }
  for (const parameter of data.parameters) {
    const { key } = parameter;
    const { row, slider } = make_parameter(parameter, (value) => send({ type: "parameter", key, value }));
    element("parameters").append(row);
    sliders.set(key, slider);
  }
});

on("state", (data) => {
  for (const [key, value] of Object.entries(data.parameters)) sliders.get(key)?.follow(value);
});
