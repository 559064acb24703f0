// Bodies dragged with the mouse: a spring from the point that is held to the cursor.
"use strict";

import { on, send } from "./connection.js";
import { element, make_parameter, number } from "./controls.js";
import { add_key } from "./keys.js";
import { add_section } from "./panel.js";

const AGAIN = 100; // [ms]: a drag is repeated, so that it goes on in a run that starts anew
const { THREE } = globalThis.MeshCat;
const caster = new THREE.Raycaster();
let picture = null, nodes = null, stiffness = 0;
let always = false; // whether it takes no key
let held = null;

const button = document.createElement("button");
button.id = "drag-mode";
button.textContent = "Drag bodies";
button.title = "Press on a body and drag it (d). With Ctrl it works without this button.";
const label = document.createElement("output");
label.id = "drag-label";

// The page's world has y up, that of the run z.
const to_run = ({ x, y, z }) => [x, -z, y];
const to_page = ([x, y, z]) => new THREE.Vector3(x, z, -y);

function aim({ clientX, clientY }) {
  const { left, top, width, height } = picture.pane.getBoundingClientRect();
  const at = new THREE.Vector2(
    (2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
  picture.viewer.camera.updateMatrixWorld();
  caster.setFromCamera(at, picture.viewer.camera);
}

// What can be seen and hides what is behind it: no arrows, and nothing that is switched off.
function solid_meshes() {
  const found = [];
  picture.viewer.scene.updateMatrixWorld();
  picture.viewer.scene.traverseVisible((one) => {
    const looks = [one.material].flat();
    if (one.isMesh && looks.some((look) => look.visible && look.depthTest)) found.push(one);
  });
  return found;
}

// The body under the cursor, or null: its node, and the point in the node's coordinates.
function pick(event) {
  aim(event);
  const [hit] = caster.intersectObjects(solid_meshes(), false);
  if (!hit) return null;
  const tree = picture.viewer.scene_tree, paths = new Map();
  for (const path of Object.keys(nodes)) {
    paths.set(tree.find(path.split("/").filter((step) => step.length)).object, path);
  }
  for (let one = hit.object; one; one = one.parent) {
    if (paths.has(one)) {
      const point = one.worldToLocal(hit.point.clone()).toArray();
      return { node: paths.get(one), point, at: hit.point };
    }
  }
  return null;
}

function say() {
  const { node, point, target } = held;
  send({ type: "drag", node, point, target, stiffness });
}

function press(event) {
  const asked = always || event.ctrlKey || event.metaKey;
  if (held || !asked || event.button !== 0 || event.isPrimary === false) return;
  const grip = pick(event);
  if (!grip) return; // beside the bodies the camera is moved
  event.preventDefault();
  event.stopPropagation();
  picture.pane.setPointerCapture(event.pointerId);
  const facing = picture.viewer.camera.getWorldDirection(new THREE.Vector3());
  const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, grip.at);
  held = { ...grip, plane, pointer: event.pointerId, target: to_run(grip.at) };
  held.timer = setInterval(say, AGAIN);
  point_out();
  say();
}

function move(event) {
  if (held?.pointer !== event.pointerId) return;
  event.stopPropagation();
  aim(event);
  const target = caster.ray.intersectPlane(held.plane, new THREE.Vector3());
  if (!target) return;
  held.target = to_run(target);
  say();
}

function let_go(event) {
  if (!held || (event.pointerId !== undefined && event.pointerId !== held.pointer)) return;
  clearInterval(held.timer);
  held = null;
  point_out();
  send({ type: "release" });
}

function point_out() {
  picture.pane.style.cursor = held ? "grabbing" : always ? "grab" : "";
}

function switch_mode() {
  if (!nodes) return;
  always = !always;
  button.setAttribute("aria-pressed", String(always));
  point_out();
}

add_key({ keys: ["d"], says: "drag bodies without Ctrl, on or off", act: switch_mode });

function show({ drag, running }) {
  label.hidden = !drag;
  if (!drag) return;
  label.textContent = `${number(drag.newtons, 3)} N${running ? "" : " (paused)"}`;
  const { x, y } = to_page(drag.target).project(picture.viewer.camera);
  const { clientWidth, clientHeight } = picture.pane;
  label.style.left = `${0.5 * (1 + x) * clientWidth}px`;
  label.style.top = `${picture.pane.offsetTop + 0.5 * (1 - y) * clientHeight}px`;
}

on("picture", (one) => { picture = one; });
on("hello", ({ drag }) => {
  if (!drag || !picture) return;
  nodes = drag.nodes;
  stiffness = drag.stiffness;
  button.setAttribute("aria-pressed", "false");
  button.onclick = switch_mode;
  element("stage").append(button, label);
  const { row } = make_parameter({
    key: "drag-stiffness", label: "Stiffness", unit: "N/m per kg", value: stiffness,
    low: stiffness / 100, high: stiffness * 100, log: true,
  }, (value) => { if (value > 0) stiffness = value; });
  const hint = document.createElement("p");
  hint.className = "hint";
  hint.textContent = "Ctrl + drag pulls the body under the cursor.";
  add_section("drag-section", "Drag").append(hint, row);
  const { pane } = picture;
  pane.addEventListener("pointerdown", press, true);
  pane.addEventListener("pointermove", move, true);
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
    pane.addEventListener(kind, let_go, true);
  }
  pane.addEventListener("contextmenu", (event) => { if (held) event.preventDefault(); }, true);
  window.addEventListener("blur", let_go);
  on("state", show);
  on("lost", () => { label.hidden = true; });
});
