// Sliders, numbers, and how they are written.
"use strict";

import { emit } from "./connection.js";

export const element = (id) => document.getElementById(id);
const STEPS = 1000;
const REST = 500; // [ms] after the last touch: until then a control does not follow the others

// Four digits; very large and very small numbers in powers of ten.
export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

export function fill(select, options) {
  select.textContent = "";
  for (const [value, text] of options) select.append(new Option(text, value));
}

// "N/m^1.5" with its exponent raised.
export function write_unit(node, unit) {
  node.textContent = "";
  unit.split(/\^(-?[\d.]+)/).forEach((piece, index) => {
    const part = index % 2 ? document.createElement("sup") : document.createTextNode(piece);
    if (index % 2) part.textContent = piece;
    node.append(part);
  });
}

// A slider from low to high, with an optional field to type the number in.
export class Slider {
  constructor(range, { low, high, log, value, field = null, output = null, tell = null }, changed) {
    Object.assign(this, { range, low, high, log, field, output, changed });
    this.tell = tell || ((number_) => number(number_));
    this.touched = 0;
    range.addEventListener("input", () => {
      this.touched = performance.now();
      this.value = this.from(Number(range.value) / STEPS);
      this.write();
      changed(this.value);
    });
    if (field) {
      field.addEventListener("change", () => {
        const typed = Number(field.value.trim().replace(",", "."));
        field.blur();
        if (!Number.isFinite(typed) || field.value.trim() === "") { this.refuse(field.value.trim()); return; }
        this.touched = performance.now();
        this.value = typed;
        this.place();
        this.write();
        changed(typed);
      });
      field.addEventListener("keydown", (event) => {
        if (event.key === "Escape") { this.write(); field.blur(); }
      });
    }
    this.set(value);
  }

  from(share) {
    if (!this.log) return Number((this.low + share * (this.high - this.low)).toPrecision(4));
    return Number((this.low * (this.high / this.low) ** share).toPrecision(3));
  }

  place() {
    const share = this.log
      ? Math.log(Math.max(this.value, this.low) / this.low) / Math.log(this.high / this.low)
      : (this.value - this.low) / (this.high - this.low);
    this.range.value = Math.round(STEPS * Math.min(1, Math.max(0, share)));
  }

  write() {
    if (this.field) this.field.value = this.tell(this.value);
    if (this.output) this.output.textContent = this.tell(this.value);
  }

  // What was typed is no number: the field goes back, and the page says so.
  refuse(text) {
    this.write();
    const name = this.field.getAttribute("aria-label");
    emit("error", { text: `"${text}" is no number: ${name} stays at ${this.field.value}.` });
  }

  set(value) {
    this.value = value;
    this.place();
    this.write();
  }

  // What another browser did, unless this one is being moved just now.
  follow(value) {
    const busy = performance.now() - this.touched < REST || document.activeElement === this.field;
    if (!busy && value !== null && value !== this.value) this.set(value);
  }
}

// One of several words: label, menu; `slider` only follows.
function make_choice(row, label, { key, choices, value }, changed) {
  const menu = document.createElement("select");
  menu.id = `parameter-${key}`;
  menu.dataset.parameter = key;
  label.htmlFor = menu.id;
  fill(menu, choices.map((word) => [word, word]));
  menu.value = value;
  menu.onchange = () => changed(menu.value);
  row.append(label, menu);
  return { row, slider: { follow: (word) => { menu.value = word; } } };
}

// One parameter: label, number with unit, slider; or a word of its choices.
export function make_parameter(parameter, changed) {
  const row = document.createElement("div");
  row.className = "row";
  const label = document.createElement("label");
  label.textContent = parameter.label;
  label.title = parameter.key;
  if (parameter.restart) {
    const mark = document.createElement("span");
    mark.className = "restart";
    mark.textContent = "restarts";
    mark.title = "A new value holds in a run that starts anew";
    label.append(mark);
  }
  if (parameter.choices?.length) return make_choice(row, label, parameter, changed);
  const entry = document.createElement("span");
  entry.className = "entry";
  const field = document.createElement("input");
  field.type = "text";
  field.inputMode = "decimal";
  field.setAttribute("aria-label", parameter.label);
  const unit = document.createElement("i");
  write_unit(unit, parameter.unit);
  entry.append(field, unit);
  const range = document.createElement("input");
  Object.assign(range, { type: "range", min: 0, max: STEPS, step: 1 });
  range.id = `parameter-${parameter.key}`;
  range.dataset.parameter = parameter.key;
  label.htmlFor = range.id;
  row.append(label, entry, range);
  return { row, slider: new Slider(range, { ...parameter, field }, changed) };
}
