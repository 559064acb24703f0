// Forces and depth of the run over time, with a cursor at the time that is shown.
const TOP = 6, BOTTOM = 20, GAP = 12;
const FORCE_SHARE = 0.62; // of the height; depth has the rest

// Factor and name of the unit in which `largest` [base: N, m, s] reads well.
function reading_unit(largest, base) {
  if (!(largest > 0 && Number.isFinite(largest))) return [1, base];
  let exponent = Math.max(-9, 3 * Math.floor((Math.log10(largest) + 1) / 3));
  if (exponent > 0) exponent = base === "N" && largest >= 1e4 ? 3 : 0;
  if (base === "m" && exponent > -3) exponent = -3;
  return [10 ** -exponent, { 3: "k", 0: "", "-3": "m", "-6": "\u00b5", "-9": "n" }[exponent] + base];
}

const digits = (value, count = 4) => String(Number(value.toPrecision(count)));

class Curve {
  constructor({ name, figures, ...columns }) {
    Object.assign(this, { name, figures });
    for (const [column, packed] of Object.entries(columns)) this[column] = unfold(packed);
    for (const column of ["normal", "friction", "depth"]) {
      this[`${column}_range`] = this[column].reduce(
        ([low, high], value) => [Math.min(low, value), Math.max(high, value)], [0, 0]);
    }
  }

  // The number of the row nearest to time t.
  row(t) {
    let low = 0, high = this.t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.t[middle] <= t) low = middle; else high = middle;
    }
    return t - this.t[low] <= this.t[high] - t ? low : high;
  }
}

class Chart {
  constructor(canvas, curves, clock, moved) {
    Object.assign(this, { canvas, clock });
    this.curves = curves.filter((curve) => curve.t.length);
    this.curve = this.curves[0] || null;
    this.now = clock.start;
    const times = this.curves.flatMap((curve) => [curve.t[0], curve.t.at(-1)]);
    // Of a part of a run the scene and the chart have the same times; one picture has all of it.
    const part = clock.end > clock.start;
    this.start = part ? clock.start : Math.min(clock.start, ...times);
    this.end = part ? clock.end : Math.max(clock.end, ...times);
    const take = (event) => {
      const share = (event.offsetX - LEFT) / (canvas.clientWidth - LEFT - RIGHT);
      moved(this.start + Math.min(1, Math.max(0, share)) * (this.end - this.start));
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      take(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) take(event);
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // Where time t is [pixels].
  x(t) {
    const width = this.canvas.clientWidth - LEFT - RIGHT;
    return LEFT + ((t - this.start) / (this.end - this.start || 1)) * width;
  }

  draw() {
    const { canvas, curve, start, end } = this;
    const area = blank(canvas);
    if (!area) return;
    const { pen, width, height } = area;
    const room = height - TOP - BOTTOM - GAP, x = (t) => this.x(t);
    const strips = [
      { columns: ["friction", "normal"], unit: "N", top: TOP, height: FORCE_SHARE * room },
      { columns: ["depth"], unit: "m", top: TOP + FORCE_SHARE * room + GAP, height: (1 - FORCE_SHARE) * room },
    ];
    time_axis(pen, color, width, { start, end, x, top: TOP, bottom: height - BOTTOM });
    for (const strip of strips) this.strip(pen, strip, width);
    const at = Math.round(x(this.now)) + 0.5;
    stroke(pen, color("--ink"), [at, TOP], [at, height - BOTTOM]);
    if (!curve) return;
    const row = curve.row(this.now);
    for (const { columns, y } of strips) {
      for (const column of columns) {
        pen.fillStyle = color(`--${column}`);
        pen.beginPath(); pen.arc(at, y(curve[column][row]), 3.2, 0, 7); pen.fill();
      }
    }
  }

  // Draw one quantity; add to the strip its scale y.
  strip(pen, strip, width) {
    const { curve } = this;
    const ranges = curve ? strip.columns.map((column) => curve[`${column}_range`]) : [[0, 0]];
    const most = Math.max(...ranges.map((range) => range[1])), least = Math.min(...ranges.map((range) => range[0]));
    const [factor, unit] = reading_unit(most, strip.unit);
    const step = nice((most - least || 1 / factor) / Math.max(1.2, strip.height / 22));
    const low = least < 0 ? Math.floor(least / step) * step : 0;
    const high = Math.max(low + step, 1.04 * most);
    const y = (value) => strip.top + ((high - value) / (high - low)) * strip.height;
    strip.y = y;
    value_axis(pen, color, width, { low, high, step, y, text: (value) => digits(value * factor, 9) });
    pen.save();
    pen.translate(10, strip.top + 0.5 * strip.height);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(unit, 0, 0);
    pen.restore();
    if (!curve) return;
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, strip.top - 2, width - LEFT - RIGHT, strip.height + 4);
    pen.clip();
    pen.lineWidth = 1.5;
    pen.lineJoin = "round";
    for (const column of strip.columns) {
      pen.strokeStyle = color(`--${column}`);
      pen.beginPath();
      curve.t.forEach((t, k) => pen.lineTo(this.x(t), y(curve[column][k])));
      pen.stroke();
    }
    pen.restore();
  }
}
