// Robots' meshes of several materials, as meshcat's viewer takes them on both pages.
"use strict";

// It merges the meshes of a file to one, with a material each. Of one with several materials it
// takes the list for one, and draws nothing: the first stands for them.
export function flatten_materials(viewer) {
  const set = viewer.set_object.bind(viewer);
  viewer.set_object = (path, object) => {
    object.traverse((one) => {
      if (!Array.isArray(one.material)) return;
      one.material = one.material.map((each) => (Array.isArray(each) ? each[0] : each));
    });
    set(path, object);
  };
}
