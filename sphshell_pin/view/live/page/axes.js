// A canvas with two axes: what the chart of the live page and that of a recording share.
"use strict";

export const LEFT = 54, RIGHT = 14; // pixels beside the curves

// The least of 1, 2, 5, 10, 20 ... that is not below `value`.
export function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  return (lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10) * power;
}

// The canvas as fine as the screen, and empty; null while it is hidden.
export function blank(canvas) {
  const ratio = globalThis.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  const pixels = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "11px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
  return { pen, width, height };
}

export function stroke(pen, paint, from, to) {
  pen.strokeStyle = paint;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
}

// A line across at each multiple of `step`, at the height y, with what `text` says of its value.
export function value_axis(pen, color, width, { low, high, step, y, text }) {
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
    const at = Math.round(y(k * step)) + 0.5;
    stroke(pen, color(k === 0 ? "--axis" : "--grid"), [LEFT, at], [width - RIGHT, at]);
    pen.fillStyle = color("--faint");
    pen.fillText(text(Number((k * step).toPrecision(9))), LEFT - 7, at);
  }
}

// A line from top to bottom at some round times, with the times below.
export function time_axis(pen, color, width, { start, end, x, top, bottom }) {
  const step = nice((end - start || 1) / Math.max(2, width / 110));
  pen.textBaseline = "top";
  pen.textAlign = "center";
  pen.fillStyle = color("--faint");
  for (let k = Math.ceil(start / step - 1e-9); k * step <= end + 1e-9 * step; k += 1) {
    const at = Math.round(x(k * step)) + 0.5;
    stroke(pen, color("--grid"), [at, top], [at, bottom]);
    if (at < width - 56) pen.fillText(String(Number((k * step).toPrecision(9))), at, bottom + 6);
  }
  pen.textAlign = "right";
  pen.fillText("t [s]", width - RIGHT, bottom + 6);
}
