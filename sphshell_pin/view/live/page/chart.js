// Curves over time on a canvas.
"use strict";

import { LEFT, RIGHT, blank, nice, stroke, time_axis, value_axis } from "./axes.js";
import { number } from "./controls.js";
import { color } from "./theme.js";

const TOP = 8, BOTTOM = 24;
const DASHES = [6, 4];
const NEAR = 0.01; // share of the window
const GHOST = 0.55; // opacity of the curves of an earlier run

// The first index of rows whose time is not before t.
export function first_at(rows, t) {
  let low = 0, high = rows.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] < t) low = middle + 1; else high = middle;
  }
  return low;
}

// The column of a curve in rows [t, value, value, ...]; -1 where it is not among them.
const column_of = (keys, key) => keys.indexOf(key) + 1 || -1;

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.curves = []; // { key, name, color: variable of palette.css }
    this.run = { keys: [], rows: [] };
    this.ghost = null; // an earlier run, like this one
    this.unit = "";
    this.from_zero = false;
    this.begin = 0; // [s]
    this.span = 6; // [s]
    this.now = 0;
    this.forget_scale();
    this.mouse = null;
    for (const kind of ["pointermove", "pointerdown"])
      canvas.addEventListener(kind, (event) => { this.mouse = event.offsetX; this.draw(); });
    canvas.addEventListener("pointerleave", () => { this.mouse = null; this.draw(); });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  forget_scale() { this.low = this.high = null; }

  draw() {
    const area = blank(this.canvas);
    if (!area) return;
    const { pen, width, height } = area;
    // At first the window stands still, then it follows.
    const start = Math.max(this.begin, this.now - this.span), end = start + this.span;
    const lines = this.lines(start, end);
    this.scale(lines);
    const x = (t) => LEFT + ((t - start) / this.span) * (width - LEFT - RIGHT);
    const y = (value) => TOP + ((this.high - value) / (this.high - this.low)) * (height - TOP - BOTTOM);
    const frame = { start, end, x, y, width, height };
    this.axes(pen, frame);
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, 0, width - LEFT - RIGHT, height - BOTTOM + 1);
    pen.clip();
    for (const line of lines.toReversed()) this.line(pen, line, x, y);
    pen.restore();
    if (this.mouse !== null) this.readout(pen, lines, frame);
  }

  // What is seen: of each curve that of this run, then that of the earlier one.
  lines(start, end) {
    const lines = [];
    for (const [run, ghost] of [[this.run, false], [this.ghost, true]]) {
      if (!run) continue;
      const first = Math.max(0, first_at(run.rows, start) - 1);
      const rows = run.rows.slice(first, first_at(run.rows, end) + 1);
      for (const curve of this.curves) {
        const column = column_of(run.keys, curve.key);
        if (column > 0 && rows.length) lines.push({ curve, column, rows, ghost });
      }
    }
    return lines;
  }

  scale(lines) {
    let least = this.from_zero ? 0 : Infinity, most = this.from_zero ? 0 : -Infinity;
    for (const { rows, column } of lines) {
      for (const row of rows) {
        const value = row[column];
        if (value !== null) { least = Math.min(least, value); most = Math.max(most, value); }
      }
    }
    if (!(most >= least)) { least = 0; most = 0; }
    // What does not change is no noise to be magnified.
    const range = Math.max(most - least, 1e-6 * Math.max(Math.abs(most), Math.abs(least)), 1e-12);
    const step = most === least ? nice(Math.abs(most) || 1) : nice(range / 4.5);
    const low = this.from_zero && least >= -1e-9 * range ? 0 : step * Math.floor(least / step - 0.1);
    const high = step * Math.ceil(most / step + (most > 0 || !this.from_zero ? 0.2 : 1));
    // The scale grows at once and shrinks late, so that it does not flicker.
    const fits = this.low !== null && least >= this.low && most <= this.high;
    if (!fits || high - low < 0.5 * (this.high - this.low)) { this.low = low; this.high = high; }
  }

  axes(pen, { start, end, x, y, width, height }) {
    const { low, high } = this;
    const text = (value) => number(value, 6);
    value_axis(pen, color, width, { low, high, step: nice((high - low) / 4.5), y, text });
    time_axis(pen, color, width, { start, end, x, top: TOP, bottom: height - BOTTOM });
  }

  line(pen, { curve, column, rows, ghost }, x, y) {
    pen.strokeStyle = color(curve.color);
    pen.globalAlpha = ghost ? GHOST : 1;
    pen.setLineDash(ghost ? DASHES : []);
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    pen.beginPath();
    let down = false;
    for (const row of rows) {
      const value = row[column];
      if (value === null) { down = false; continue; }
      if (down) pen.lineTo(x(row[0]), y(value)); else pen.moveTo(x(row[0]), y(value));
      down = true;
    }
    pen.stroke();
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  // The values at the mouse: of each curve the point that is nearest in time, if it has one there.
  readout(pen, lines, { start, x, y, width, height }) {
    const t = start + ((this.mouse - LEFT) / (width - LEFT - RIGHT)) * this.span;
    this.read = null;
    const found = [];
    for (const line of lines) {
      const k = first_at(line.rows, t);
      const near = [line.rows[k - 1], line.rows[k]].filter(Boolean)
        .reduce((a, b) => (Math.abs(a[0] - t) <= Math.abs(b[0] - t) ? a : b));
      if (Math.abs(near[0] - t) > NEAR * this.span) continue;
      if (near[line.column] !== null) found.push({ ...line, t: near[0], value: near[line.column] });
    }
    if (!found.length) return;
    const at = Math.round(x(found[0].t)) + 0.5;
    stroke(pen, color("--axis"), [at, TOP], [at, height - BOTTOM]);
    const most = Math.max(2, Math.floor((height - BOTTOM - TOP - 22) / 15));
    const texts = [`${found[0].t.toFixed(4)} s`];
    for (const { curve, value, ghost } of found.slice(0, most)) {
      texts.push(`${Number(value.toPrecision(4))} ${this.unit}  ${curve.name}${ghost ? ", earlier" : ""}`);
    }
    if (found.length > most) texts.push(`and ${found.length - most} more`);
    const wide = 12 + Math.max(...texts.map((text) => pen.measureText(text).width));
    const left = at + wide + 8 > width ? Math.max(0, at - wide - 6) : at + 6;
    pen.fillStyle = color("--overlay");
    pen.fillRect(left, TOP, wide, 8 + 15 * texts.length);
    pen.textAlign = "left";
    pen.textBaseline = "top";
    texts.forEach((text, k) => {
      const line = found[k - 1];
      pen.fillStyle = color(line && k <= most ? line.curve.color : "--ink");
      pen.fillText(text, left + 6, TOP + 4 + 15 * k);
    });
    this.read = texts;
    for (const { curve, value, t: own } of found) {
      pen.fillStyle = color(curve.color);
      pen.beginPath(); pen.arc(x(own), y(value), 3, 0, 7); pen.fill();
    }
  }
}
