// Colors of the style sheet for what is drawn by scripts, light or dark as the user prefers.
"use strict";

import { emit } from "./events.js";

let style = getComputedStyle(document.documentElement);
const known = new Map();

// The color of a variable of palette.css, such as "--ink".
export function color(name) {
  if (!known.has(name)) known.set(name, style.getPropertyValue(name).trim());
  return known.get(name);
}

// "#rrggbb" as three numbers from 0 to 1.
export const parts = (name) => [1, 3, 5].map((k) => parseInt(color(name).slice(k, k + 2), 16) / 255);

globalThis.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  style = getComputedStyle(document.documentElement);
  known.clear();
  emit("theme");
});
