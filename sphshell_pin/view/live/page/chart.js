// A strip chart on a canvas: normal and friction force over the last seconds.
"use strict";

import { number } from "./controls.js";

const MOST = 1600;
const LEFT = 46, RIGHT = 14, TOP = 8, BOTTOM = 24;

export function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  return (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10) * power;
}

export class Chart {
  constructor(canvas, colors) {
    this.canvas = canvas;
    this.colors = colors;
    this.rows = [];
    this.pair = null; // the sum of all
    this.span = 6;
    this.now = 0;
    this.top = 0;
    this.mouse = null;
    canvas.addEventListener("pointermove", (event) => { this.mouse = event.offsetX; this.draw(); });
    canvas.addEventListener("pointerleave", () => { this.mouse = null; this.draw(); });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  add(rows, clear) {
    if (clear) { this.rows = []; this.top = 0; }
    for (const row of rows) {
      // A run that started anew has an earlier time: what was later is gone.
      while (this.rows.length && this.rows.at(-1)[0] >= row[0]) this.rows.pop();
      this.rows.push(row);
    }
    if (this.rows.length > MOST) this.rows.splice(0, this.rows.length - MOST);
  }

  value(row, column) {
    const values = row[column];
    if (this.pair !== null) return values[this.pair];
    let sum = 0;
    for (const value of values) { if (value === null) return null; sum += value; }
    return sum;
  }

  draw() {
    const { canvas } = this;
    const ratio = globalThis.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
    const end = Math.max(this.now, this.rows.length ? this.rows.at(-1)[0] : 0);
    const start = end - this.span;
    const seen = this.rows.filter((row) => row[0] >= start - 0.02 * this.span && row[0] <= end);
    let most = 0, least = 0;
    for (const row of seen) {
      for (const column of [1, 2]) {
        const value = this.value(row, column);
        if (value !== null) { most = Math.max(most, value); least = Math.min(least, value); }
      }
    }
    // The scale grows at once and shrinks late, so that it does not flicker.
    const wanted = most > 0 ? nice(1.08 * most) : 1;
    if (wanted > this.top || wanted < 0.45 * this.top || !this.top) this.top = wanted;
    const low = least < -1e-9 * this.top ? -nice(-1.05 * least) : 0;
    const x = (t) => LEFT + ((t - start) / this.span) * (width - LEFT - RIGHT);
    const y = (f) => TOP + ((this.top - f) / (this.top - low)) * (height - TOP - BOTTOM);
    this.axes(pen, { start, end, low, x, y, width, height });
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, 0, width - LEFT - RIGHT, height - BOTTOM + 1);
    pen.clip();
    this.line(pen, seen, 2, this.colors.friction, x, y);
    this.line(pen, seen, 1, this.colors.normal, x, y);
    pen.restore();
    if (this.mouse !== null && seen.length) this.readout(pen, { seen, start, x, y, width, height });
  }

  axes(pen, { start, end, low, x, y, width, height }) {
    const range = this.top - low;
    const step = nice(range / 4.5);
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let k = Math.ceil(low / step - 1e-9); k * step <= this.top * (1 + 1e-9); k += 1) {
      const at = Math.round(y(k * step)) + 0.5;
      pen.strokeStyle = k === 0 ? "#b8c2cb" : "#e9edf1";
      pen.beginPath(); pen.moveTo(LEFT, at); pen.lineTo(width - RIGHT, at); pen.stroke();
      pen.fillStyle = "#67737f";
      pen.fillText(number(k * step, 6), LEFT - 7, at);
    }
    const tick = nice(this.span / 7);
    pen.textBaseline = "top";
    pen.textAlign = "center";
    for (let k = Math.ceil(start / tick - 1e-9); k * tick <= end + 1e-9 * tick; k += 1) {
      const at = Math.round(x(k * tick)) + 0.5;
      if (k < 0 || at > width - 44) continue;
      pen.strokeStyle = "#e9edf1";
      pen.beginPath(); pen.moveTo(at, TOP); pen.lineTo(at, height - BOTTOM); pen.stroke();
      pen.fillText(String(Number((k * tick).toPrecision(9))), at, height - BOTTOM + 6);
    }
    pen.textAlign = "right";
    pen.fillText("t [s]", width - RIGHT, height - BOTTOM + 6);
  }

  line(pen, rows, column, color, x, y) {
    pen.strokeStyle = color;
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    pen.beginPath();
    let down = false;
    for (const row of rows) {
      const value = this.value(row, column);
      if (value === null) { down = false; continue; }
      if (down) pen.lineTo(x(row[0]), y(value)); else pen.moveTo(x(row[0]), y(value));
      down = true;
    }
    pen.stroke();
  }

  readout(pen, { seen, start, x, y, width, height }) {
    const t = start + ((this.mouse - LEFT) / (width - LEFT - RIGHT)) * this.span;
    const row = seen.reduce((best, one) => (Math.abs(one[0] - t) < Math.abs(best[0] - t) ? one : best));
    const at = Math.round(x(row[0])) + 0.5;
    pen.strokeStyle = "#9aa6b1";
    pen.beginPath(); pen.moveTo(at, TOP); pen.lineTo(at, height - BOTTOM); pen.stroke();
    const tell = (value) => (value === null ? "-" : `${Number(value.toPrecision(4))} N`);
    const texts = [`${row[0].toFixed(4)} s`, tell(this.value(row, 1)), tell(this.value(row, 2))];
    const wide = 12 + Math.max(...texts.map((text) => pen.measureText(text).width));
    const left = at + wide + 8 > width ? at - wide - 6 : at + 6;
    pen.fillStyle = "rgba(255, 255, 255, 0.92)";
    pen.fillRect(left, TOP, wide, 50);
    pen.textAlign = "left";
    texts.forEach((text, k) => {
      pen.fillStyle = ["#1c2630", this.colors.normal, this.colors.friction][k];
      pen.fillText(text, left + 6, TOP + 4 + 15 * k);
    });
    for (const [column, color] of [[1, this.colors.normal], [2, this.colors.friction]]) {
      const value = this.value(row, column);
      if (value === null) continue;
      pen.fillStyle = color;
      pen.beginPath(); pen.arc(at, y(value), 3, 0, 7); pen.fill();
    }
  }
}
