// The picture: meshcat's viewer, fed with lists of its own commands.
"use strict";

import { emit, on } from "./connection.js";
import { element } from "./controls.js";
import { notice } from "./notices.js";
import { paint, viewer_in } from "./pane.js";

const { THREE } = globalThis.MeshCat;
const ASPECT = 1.2; // as camera.py has it

export class Picture {
  constructor(pane) {
    this.pane = pane;
    const viewer = viewer_in(pane, () => this.fit());
    this.viewer = viewer;
    new ResizeObserver(() => viewer.set_3d_pane_size()).observe(pane);
    this.eye = null;
    this.target = null;
    this.settled = false; // the camera belongs to the user once it has been placed
    this.take = viewer.handle_command.bind(viewer);
    viewer.handle_command = (command) => this.handle(command);
    paint(viewer);
  }

  draw(buffer) {
    this.viewer.handle_command_bytearray(new Uint8Array(buffer));
    this.settled = this.settled || this.target !== null;
  }

  handle(command) {
    if (Array.isArray(command)) {
      for (const one of command) this.handle(one);
    } else if (command.type === "move") {
      this.move(command);
    } else if (command.type === "set_target") {
      this.target = command.value;
      if (!this.settled) this.viewer.controls.target.fromArray(command.value);
    } else if (command.path && command.path.startsWith("/Cameras")) {
      if (command.property === "position") this.eye = command.value;
      if (!this.settled) this.take(command);
      this.fit();
    } else if (command.path !== "/Background") {
      this.take(command);
    }
  }

  // The view was chosen for a pane of that shape: a narrower one shows as much of its width.
  fit() {
    const { camera } = this.viewer;
    camera.zoom = Math.min(1, this.pane.clientWidth / this.pane.clientHeight / ASPECT);
    camera.updateProjectionMatrix();
  }

  move({ paths, matrices }) {
    const tree = this.viewer.scene_tree;
    paths.forEach((path, index) => {
      const steps = path.split("/").filter((step) => step.length);
      tree.find(steps).set_transform(matrices.subarray(16 * index, 16 * index + 16));
    });
    this.viewer.set_dirty();
  }

  look() {
    if (!this.eye || !this.target) return;
    this.viewer.camera.position.fromArray(this.eye);
    this.fit();
    this.viewer.controls.target.fromArray(this.target);
    this.viewer.controls.update();
    this.viewer.set_dirty();
  }

  // A direction of the screen as a vector of the world, whose z is up.
  direction(name) {
    const [column, sign] = {
      right: [0, 1], left: [0, -1], up: [1, 1], down: [1, -1], near: [2, 1], away: [2, -1],
    }[name];
    this.viewer.camera.updateMatrixWorld();
    const axis = new THREE.Vector3().setFromMatrixColumn(this.viewer.camera.matrixWorld, column);
    return [sign * axis.x, -sign * axis.z, sign * axis.y];
  }
}

let picture = null;
on("frame", (buffer) => picture?.draw(buffer));
on("hello", () => {
  try {
    picture = new Picture(element("scene"));
  } catch {
    notice("This browser cannot draw the scene: it has no WebGL. All else works.", "blind");
    return;
  }
  emit("picture", picture);
});
