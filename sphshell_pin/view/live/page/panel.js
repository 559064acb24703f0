// The side panel and the figures over the scene.
"use strict";

import { on } from "./connection.js";
import { element, number } from "./controls.js";

// A section before that of the view; returns the node for its content.
export function add_section(id, title) {
  const section = document.createElement("details");
  section.id = id;
  section.open = true;
  const summary = document.createElement("summary");
  summary.textContent = title;
  const body = document.createElement("div");
  section.append(summary, body);
  element("view-section").before(section);
  return body;
}

on("hello", (data) => {
  element("pressure-swatch").style.background =
    `linear-gradient(90deg, ${data.pressure_ramp.join(", ")})`;
  for (const [name, color] of Object.entries(data.colors))
    element(`${name}-swatch`).style.background = color;
  document.title = data.title;
  element("title").textContent = data.title;
  element("title").title = data.title;
});

on("state", (data) => {
  element("time").textContent = data.t.toFixed(data.speed < 0.2 ? 5 : 3);
  element("factor").textContent = data.running
    ? data.factor.toFixed(data.factor < 0.1 ? 3 : 2) : "paused";
  element("times").hidden = !data.running;
  element("residual").textContent = number(data.residual, 2);
  element("relative").textContent = data.relative === null
    ? "energy residual" : `residual, ${number(data.relative, 2)} of exchanged`;
  element("scale").textContent = data.scale;
  element("cut").hidden = !data.cut;
  element("axes").hidden = !data.show.frames;
  for (const name of ["pressure", "grid"]) {
    element(name).hidden = !data[name];
    element(name).lastChild.textContent = data[name] ?? "";
  }
});

function fold(name, buttons, what) {
  const folded = document.body.classList.toggle(name);
  for (const button of buttons.map(element)) {
    button.title = `${folded ? "Show" : "Hide"} ${what}`;
    button.setAttribute("aria-label", button.title);
  }
}
element("fold").onclick = element("unfold").onclick =
  () => fold("folded", ["fold", "unfold"], "the panel");
element("fold-dock").onclick = () => fold("low", ["fold-dock"], "the chart and the list");
