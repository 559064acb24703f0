// Where to look from: presets, and the camera that follows the tip.
const PRESETS = [
  ["fit", "Fit", "All that is near the contact"],
  ["front", "Front", "Along -x"],
  ["side", "Side", "Along y"],
  ["top", "Top", "From above"],
  ["follow", "Follow", "Moves with the tip"],
  ["contact", "Contact", "Close to the contact, moves with it"],
];

class Cameras {
  constructor(viewer, { views, focus, aspect, clock }) {
    Object.assign(this, { viewer, views, aspect });
    this.frames = clock.frames;
    this.whole = Math.hypot(...views.fit.eye.map((value, k) => value - views.fit.target[k]));
    this.distance = focus ? focus.distance : null;
    this.points = focus ? unfold(focus.points) : null;
    this.names = PRESETS.map(([name]) => name).filter((name) => views[name] || focus);
    this.share = 0; // of the page's time
    this.name = null; // of the preset, null once the mouse has moved the camera
    this.moving = null; // where the tip was that the camera moves with
    this.changed = () => {};
    viewer.controls.addEventListener("start", () => { this.name = null; this.changed(); });
  }

  // The tip [m] at the time that is shown.
  tip() {
    const at = this.share * (this.frames - 1);
    const low = Math.min(Math.floor(at), this.frames - 1), high = Math.min(low + 1, this.frames - 1);
    return [0, 1, 2].map((k) => {
      const from = this.points[3 * low + k];
      return from + (at - low) * (this.points[3 * high + k] - from);
    });
  }

  look(name) {
    const { eye, target } = this.views[name] || this.close(name);
    const { camera, controls } = this.viewer;
    // The views fit into a picture of this aspect; a narrower one needs more distance.
    const far = Math.max(1, this.aspect / camera.aspect);
    const at = eye.map((value, k) => target[k] + far * (value - target[k]));
    camera.position.fromArray(y_up(at));
    camera.zoom = 1;
    controls.target.fromArray(y_up(target));
    controls.update();
    this.name = name;
    this.moving = this.views[name] ? null : this.tip();
    this.thin(Math.hypot(...eye.map((value, k) => value - target[k])) / this.whole);
    this.viewer.set_dirty();
    this.changed();
  }

  // Seen from the side of the first view; "follow" stands between that and the close-up.
  close(name) {
    const { eye, target } = this.views.fit;
    const near = name === "contact" ? this.distance : Math.sqrt(this.whole * this.distance);
    const share = Math.min(1, near / this.whole);
    const tip = this.tip();
    return { eye: tip.map((value, k) => value + share * (eye[k] - target[k])), target: tip };
  }

  // Arrows and points are made for the first view: from near they would hide the contact.
  thin(share) {
    const width = Math.min(1, Math.max(0.3, share));
    const { contacts } = this.viewer.scene_tree.children.meshcat?.children || {};
    for (const [name, node] of Object.entries(contacts?.children || {})) {
      const point = name.startsWith("point_");
      for (const part of point ? [node] : Object.values(node.children)) {
        part.children["<object>"]?.object.scale.set(width, point ? width : 1, width);
      }
    }
  }

  // The scene is at this share of its time now.
  go(share) {
    this.share = share;
    if (!this.moving) return;
    const tip = this.tip();
    const step = y_up(tip.map((value, k) => value - this.moving[k]));
    const { camera, controls } = this.viewer;
    camera.position.set(...["x", "y", "z"].map((axis, k) => camera.position[axis] + step[k]));
    controls.target.set(...["x", "y", "z"].map((axis, k) => controls.target[axis] + step[k]));
    this.moving = tip;
  }

  // The pane has another size.
  fit_again() {
    if (this.name) this.look(this.name);
  }
}

// A point of the world, whose z is up, as the page's camera has it.
const y_up = ([x, y, z]) => [x, z, -y];
