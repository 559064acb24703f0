// What is drawn, and how long the arrows are.
"use strict";

import { on, send } from "./connection.js";
import { element, number, Slider } from "./controls.js";

const PARTS = {
  robot: "Robot", spheres: "Spheres", arrows: "Force arrows", points: "Contact points",
  trails: "Trails", wireframe: "Wireframe",
  curved: "Curved surface", frames: "Axes of frames", grid: "Grid",
  faces: "Face colors", pressure: "Pressure patches",
};
const boxes = new Map();
let arrows = null, picture = null;

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

on("picture", (one) => { picture = one; });
on("hello", () => {
  arrows = new Slider(element("arrows"), {
    low: 0.1, high: 10, log: true, value: 1, output: element("arrows-value"),
    tell: (value) => `${number(value, 2)} \u00d7`,
  }, (value) => send({ type: "arrows", value: Math.abs(value - 1) < 0.03 ? 1 : value }));
});
on("state", (data) => {
  arrows.follow(data.arrows);
  for (const [part, box] of boxes) {
    box.parentElement.hidden = !(part in data.show); // nothing to show
    box.checked = data.show[part] ?? false;
  }
});
element("look").onclick = () => picture?.look();
