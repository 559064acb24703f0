// Meshcat's viewer, as both pages have it.
"use strict";

import { on } from "./events.js";
import { parts } from "./theme.js";

// A viewer that fills `pane`; `fit` is called before each change of its size.
export function viewer_in(pane, fit = () => {}) {
  const viewer = new globalThis.MeshCat.Viewer(pane);
  globalThis.viewer = viewer;
  viewer.gui.domElement.style.display = "none";
  flatten_materials(viewer);
  // The viewer takes the whole window for its own.
  const resize = viewer.set_3d_pane_size.bind(viewer);
  viewer.set_3d_pane_size = () => {
    if (!pane.clientWidth || !pane.clientHeight) return;
    fit();
    resize(pane.clientWidth, pane.clientHeight);
  };
  on("theme", () => paint(viewer));
  return viewer;
}

// The background has the colors of the page.
export function paint(viewer) {
  for (const [property, name] of [["top_color", "--sky"], ["bottom_color", "--earth"]]) {
    viewer.set_property(["Background"], property, parts(name));
  }
  viewer.set_dirty();
}

// The viewer merges the meshes of a robot's file to one, with a material each. Of one with several
// materials it takes the list for one, and draws nothing: the first stands for them.
function flatten_materials(viewer) {
  const set = viewer.set_object.bind(viewer);
  viewer.set_object = (path, object) => {
    object.traverse((one) => {
      if (!Array.isArray(one.material)) return;
      one.material = one.material.map((each) => (Array.isArray(each) ? each[0] : each));
    });
    set(path, object);
  };
}
