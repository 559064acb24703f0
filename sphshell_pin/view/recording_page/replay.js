// What the page holds: meshcat's viewer, and the commands that draw the scene.
"use strict";

const element = (id) => document.getElementById(id);

async function unpack(name) {
  if (!("DecompressionStream" in window)) {
    throw new Error("this browser is too old: Chrome 80, Firefox 113, Safari 16.4 or newer");
  }
  const text = document.getElementById(name).textContent.trim();
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain);
}

async function start_viewer() {
  const script = document.createElement("script");
  script.textContent = await (await unpack("viewer")).text();
  document.head.append(script);
  return viewer_in(element("pane"));
}

// A list of numbers of a mesh (meshes.py says how it is packed).
function unfold({ count, stride, low, step, width, bytes }) {
  const rows = count / stride;
  const list = new Array(count);
  for (let component = 0; component < stride; component++) {
    let whole = 0;
    for (let row = 0; row < rows; row++) {
      let folded = 0;
      for (let byte = width - 1; byte >= 0; byte--) {
        folded = 256 * folded + bytes[byte * count + component * rows + row];
      }
      whole += folded % 2 ? -(folded + 1) / 2 : folded / 2;
      list[row * stride + component] = low + step * whole;
    }
  }
  return list;
}

function restore(text, numbers) {
  if (!numbers.length) return text;
  const words = numbers.map((list) => unfold(list)
    .map((value) => (Number.isInteger(value) ? value : value.toPrecision(7))).join(" "));
  return text.split("$$").map((piece, k) => piece + (k < words.length ? words[k] : "")).join("");
}

// The binary STL file of facets that share their points (meshes.py).
function restore_facets({ points, corners }) {
  const place = unfold(points);
  const corner = unfold(corners);
  const count = corner.length / 3;
  const file = new DataView(new ArrayBuffer(84 + 50 * count));
  file.setUint32(80, count, true);
  for (let facet = 0; facet < count; facet++) {
    const [a, b, c] = [0, 1, 2].map((k) => {
      const from = 3 * corner[3 * facet + k];
      return [place[from], place[from + 1], place[from + 2]];
    });
    const [u, v] = [b, c].map((end) => end.map((x, axis) => x - a[axis]));
    const cross = [0, 1, 2].map((k) => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
    const size = Math.hypot(...cross) || 1;
    [...cross.map((x) => x / size), ...a, ...b, ...c].forEach((x, k) => {
      file.setFloat32(84 + 50 * facet + 4 * k, x, true);
    });
  }
  return new Uint8Array(file.buffer);
}

// Long texts and files are stored once; {"$text": name} stands for them.
const texts = {};
function resolve(value) {
  if (value === null || typeof value !== "object" || ArrayBuffer.isView(value)) return value;
  if ("$text" in value) return texts[value.$text];
  for (const key of Object.keys(value)) value[key] = resolve(value[key]);
  return value;
}

// Draw the scene; return what the page knows of the run besides.
function replay(viewer, buffer) {
  let panel = null;
  let lost = 0;
  const take = viewer.handle_command.bind(viewer);
  viewer.handle_command = (command) => {
    if (command.type === "text") {
      texts[command.name] = command.facets
        ? restore_facets(command.facets) : restore(command.text, command.numbers);
    } else if (command.type === "panel") {
      panel = command;
    } else if (command.type === "set_target") {
      viewer.controls.target.fromArray(command.value);
    } else if (command.type === "set_object") {
      // The viewer cannot draw every mesh file: the others are worth seeing.
      try { take(resolve(command)); } catch { lost += 1; }
    } else {
      take(resolve(command));
    }
  };
  const lengths = new DataView(buffer);
  for (let at = 0; at < buffer.byteLength;) {
    const length = lengths.getUint32(at, true);
    viewer.handle_command_bytearray(new Uint8Array(buffer.slice(at + 4, at + 4 + length)));
    at += 4 + length;
  }
  if (lost) {
    const count = lost === 1 ? "One mesh" : `${lost} meshes`;
    element("fault").textContent = `${count} cannot be drawn by this viewer.`;
  }
  return panel;
}
