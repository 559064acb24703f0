// The chart below the scene: which curves it shows, of this run and of an earlier one.
"use strict";

import { Chart } from "./chart.js";
import { on, send } from "./connection.js";
import { element, fill } from "./controls.js";
import { add_key } from "./keys.js";
import { toast } from "./notices.js";
import { color } from "./theme.js";

const MOST_ROWS = 4000;
const MOST_CURVES = 8; // as many colors as palette.css has
const AT_FIRST = 8;

const chart = new Chart(element("chart"));
const quantities = new Map(); // "Force [N]": { name, unit, series, chosen: keys }
const earlier = { last: null, kept: null }; // runs to compare with
let before = null; // the rows up to the last time they were cleared
let shown = null, span = 6;

on("hello", (data) => {
  for (const one of data.series) {
    const name = one.unit ? `${one.quantity} [${one.unit}]` : one.quantity;
    if (!quantities.has(name)) quantities.set(name, { name, unit: one.unit, series: [], chosen: [] });
    quantities.get(name).series.push(one);
  }
  for (const quantity of quantities.values()) {
    const own = quantity.series.filter((one) => one.color);
    quantity.chosen = (own.length ? own : quantity.series).slice(0, AT_FIRST).map((one) => one.key);
  }
  fill(element("quantity"), [...quantities.keys()].map((name) => [name, name]));
  span = data.window;
  chart.begin = data.start;
  choose([...quantities.keys()][0]);
});
on("joined", ask);

function ask() {
  if (shown) send({ type: "charts", keys: shown.chosen });
}

function choose(name) {
  shown = quantities.get(name);
  element("curve-list").textContent = "";
  for (const one of shown.series) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.value = one.key;
    box.checked = shown.chosen.includes(one.key);
    box.onchange = () => tick(box);
    label.append(box, document.createElement("u"), one.name);
    element("curve-list").append(label);
  }
  element("curves").hidden = shown.series.length < 2;
  element("chart").setAttribute("aria-label", `${name} over time`);
  update();
}

function tick(box) {
  if (box.checked && shown.chosen.length >= MOST_CURVES) {
    box.checked = false;
    toast(`At most ${MOST_CURVES} curves fit into the chart: take another one away first.`);
    return;
  }
  const boxes = [...element("curve-list").querySelectorAll("input")];
  shown.chosen = boxes.filter((one) => one.checked).map((one) => one.value);
  update();
}

function update() {
  const series = shown.series.filter((one) => shown.chosen.includes(one.key));
  let next = 0;
  chart.curves = series.map((one) => ({
    key: one.key, name: one.name, color: one.color ? `--${one.color}` : `--curve-${(next += 1)}`,
  }));
  chart.unit = shown.unit;
  chart.from_zero = series.some((one) => one.from_zero);
  chart.forget_scale();
  legend();
  chart.draw();
  ask();
}

function legend() {
  for (const box of element("curve-list").querySelectorAll("input")) {
    const curve = chart.curves.find((one) => one.key === box.value);
    box.nextSibling.style.color = curve ? color(curve.color) : "transparent";
  }
  const node = element("curve-legend");
  node.textContent = "";
  const entries = chart.curves.map((one) => [one.name, color(one.color), ""]);
  if (chart.ghost) entries.push([`${element("compare").value} run`, color("--faint"), "dashed"]);
  for (const [name, paint, kind] of entries) {
    const key = document.createElement("span");
    key.className = `key ${kind}`;
    const swatch = document.createElement("u");
    swatch.style.color = paint;
    key.append(swatch, name);
    node.append(key);
  }
  arrange();
}

// Names that have no room in the header stand below it.
function arrange() {
  const { classList } = element("plot"), node = element("curve-legend");
  classList.remove("many");
  classList.toggle("many", node.scrollWidth > node.clientWidth + 1);
}
window.addEventListener("resize", arrange);

function compare() {
  element("compare").hidden = !earlier.last && !earlier.kept;
  chart.ghost = earlier[element("compare").value] ?? null;
  for (const option of element("compare").options) {
    option.disabled = Boolean(option.value) && !earlier[option.value];
  }
  legend();
  chart.draw();
}

on("rows", ({ keys, rows, clear }) => {
  const { run } = chart;
  if (clear) {
    before = { keys: run.keys, rows: run.rows };
    run.rows = [];
    chart.forget_scale();
  }
  run.keys = keys;
  for (const row of rows) {
    // A run that started anew has an earlier time: what was later is gone.
    while (run.rows.length && run.rows.at(-1)[0] >= row[0]) run.rows.pop();
    run.rows.push(row);
  }
  if (run.rows.length > MOST_ROWS) run.rows.splice(0, run.rows.length - MOST_ROWS);
});

on("state", (data) => {
  if (data.t < chart.now && before?.rows.length) { // it started anew
    earlier.last = before;
    compare();
  }
  chart.now = data.t;
  chart.span = span * data.speed;
  chart.draw();
});

on("theme", () => { legend(); chart.draw(); });

element("quantity").onchange = () => choose(element("quantity").value);
element("compare").onchange = compare;

const keep = () => {
  if (element("keep").hidden) return;
  earlier.kept = { keys: chart.run.keys, rows: [...chart.run.rows] };
  element("compare").value = "kept";
  compare();
};
element("keep").onclick = keep;
add_key({ keys: ["k"], says: "keep this run to compare with", act: keep });
add_key({
  keys: ["c"], says: "compare with the last run, or with none",
  act: () => {
    element("compare").value = element("compare").value ? "" : "last";
    compare();
  },
});

// The list of curves closes like a menu.
document.addEventListener("pointerdown", (event) => {
  if (!element("curves").contains(event.target)) element("curves").open = false;
});
element("curves").addEventListener("keydown", (event) => {
  if (event.key !== "Escape") return;
  element("curves").open = false;
  element("curves").querySelector("summary").focus();
});
globalThis.chart = chart; // for tests and the console
