// The panel: time, speed, cameras, what is shown, keys.
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4]; // of the pace that the recording was made at
const LEAP = 10; // frames, with the shift key
const still = matchMedia("(prefers-reduced-motion: reduce)");
const small = matchMedia("(max-width: 900px), (max-height: 600px)");

class Panel {
  constructor(viewer, data) {
    const { clock } = data;
    Object.assign(this, { viewer, clock });
    this.span = clock.end - clock.start;
    this.step = clock.frames > 1 ? this.span / (clock.frames - 1) : 0;
    this.time = clock.start; // of the run [s]
    this.rate = clock.speed; // simulated seconds per second
    this.loop = this.playing = false;
    // An action takes part once it was played; the animator's own clock stays at rest.
    for (const action of viewer.animator.actions) action.play();
    this.cameras = new Cameras(viewer, data);
    this.chart = new Chart(element("chart"), data.curves.map((one) => new Curve(one)), clock, (t) => { this.pause(); this.seek(t); });
    this.add_time();
    this.add_cameras();
    this.add_parts();
    this.add_curves();
    this.add_keys();
    this.follow_surroundings();
    this.seek(clock.start);
  }

  // Time

  add_time() {
    const scrub = element("scrub");
    scrub.max = this.span || 1;
    scrub.addEventListener("input", () => { this.pause(); this.seek(this.clock.start + Number(scrub.value)); });
    element("play").onclick = () => this.toggle();
    element("first").onclick = () => this.go_to(this.clock.start);
    element("last").onclick = () => this.go_to(this.clock.end);
    element("back").onclick = () => this.go(-1);
    element("on").onclick = () => this.go(1);
    const speed = element("speed");
    for (const factor of SPEEDS) {
      const rate = Number((factor * this.clock.speed).toPrecision(6));
      speed.append(new Option(`${rate}\u00d7`, rate, factor === 1, factor === 1));
    }
    speed.onchange = () => { this.rate = Number(speed.value); };
    element("loop").onclick = () => this.set_loop(!this.loop);
  }

  seek(t) {
    this.time = Math.min(this.clock.end, Math.max(this.clock.start, t));
    const { time, clock } = this, passed = time - clock.start;
    this.viewer.animator.seek(passed / clock.speed);
    this.cameras.go(this.span ? passed / this.span : 0);
    this.viewer.set_dirty();
    const scrub = element("scrub");
    scrub.value = passed;
    // What a screen reader says; the end is on the page once.
    scrub.setAttribute("aria-valuetext", `${time.toFixed(clock.digits)} seconds`);
    scrub.style.setProperty("--passed", `${this.span ? (100 * passed) / this.span : 0}%`);
    element("clock").textContent = `${time.toFixed(clock.digits)} / ${clock.end.toFixed(clock.digits)} s`;
    element("film-clock").textContent = `t = ${time.toFixed(clock.digits)} s${this.pace()}`;
    this.chart.now = time;
    this.chart.draw();
    this.read();
  }

  // At which pace a film of the page shows the run.
  pace() {
    return this.clock.speed === 1 ? "" : ` (${digits(this.clock.speed)} \u00d7 real time)`;
  }

  go_to(t) { this.pause(); this.seek(t); }

  // To the frame that is `count` frames on.
  go(count) {
    if (!this.step) return;
    const at = (this.time - this.clock.start) / this.step;
    const frame = count > 0 ? Math.floor(at + 1e-6) : Math.ceil(at - 1e-6);
    this.go_to(this.clock.start + (frame + count) * this.step);
  }

  play() {
    if (this.playing || !this.span) return;
    if (this.time >= this.clock.end) this.seek(this.clock.start);
    this.playing = true;
    this.mark();
    let before = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      let t = this.time + (this.rate * Math.max(0, now - before)) / 1000;
      before = now;
      if (t >= this.clock.end && this.loop) t = this.clock.start + ((t - this.clock.start) % this.span);
      this.seek(t);
      if (t >= this.clock.end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() { this.playing = false; this.mark(); }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  mark() {
    element("play").classList.toggle("running", this.playing);
    element("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  set_loop(on) {
    this.loop = on;
    element("loop").setAttribute("aria-pressed", on);
  }

  pace_by(steps) {
    const speed = element("speed");
    speed.selectedIndex = Math.min(SPEEDS.length - 1, Math.max(0, speed.selectedIndex + steps));
    speed.onchange();
  }

  // Cameras and what is shown

  add_cameras() {
    for (const [name, label, title] of PRESETS) {
      if (!this.cameras.names.includes(name)) continue;
      const button = document.createElement("button");
      Object.assign(button, { textContent: label, title: `${title} (${element("views").children.length + 1})` });
      button.dataset.view = name;
      button.onclick = () => this.cameras.look(name);
      element("views").append(button);
    }
    this.cameras.changed = () => {
      for (const button of element("views").children) {
        button.setAttribute("aria-pressed", button.dataset.view === this.cameras.name);
      }
    };
  }

  add_parts() {
    const tree = this.viewer.scene_tree.children.meshcat?.children || {};
    const children = (node) => (node ? Object.entries(node.children) : []);
    const below = (node, pattern) => children(node).filter(([name]) => pattern.test(name)).map(([, child]) => child);
    const in_shells = (name) => children(tree.shells).flatMap(([, shell]) => below(shell, new RegExp(`^${name}$`)));
    const parts = {
      Robot: tree.robot ? [tree.robot] : [],
      Spheres: tree.spheres ? [tree.spheres] : [],
      Arrows: below(tree.contacts, /^(normal|friction|total)_/),
      Points: [...below(tree.contacts, /^point_/), ...(tree.pressure ? [tree.pressure] : [])],
      Path: in_shells("trail"),
      Wireframe: in_shells("elements"),
      Grid: tree.grid ? [tree.grid] : [],
    };
    for (const [label, nodes] of Object.entries(parts)) {
      const drawn = nodes.filter((node) => Object.keys(node.children).length);
      if (!drawn.length) continue;
      const box = Object.assign(document.createElement("input"), { type: "checkbox" });
      // A patch stands in place of its contact's point, which stays hidden.
      const shown = drawn.filter((node) => node.object.visible);
      box.checked = shown.length > 0;
      box.onchange = () => {
        for (const node of shown.length ? shown : drawn) node.object.visible = box.checked;
        this.viewer.set_dirty();
      };
      const line = document.createElement("label");
      line.append(box, label);
      element("parts").append(line);
    }
  }

  follow_surroundings() {
    on("theme", () => this.chart.draw());
    emit("theme");
    const fit = () => { this.viewer.set_3d_pane_size(); this.cameras.fit_again(); };
    new ResizeObserver(fit).observe(element("pane"));
    this.cameras.look("fit");
    const fold = () => { element("key").open = !small.matches; };
    small.addEventListener("change", fold);
    fold();
  }

  // Curves

  add_curves() {
    const { curves } = this.chart;
    const pair = element("pair");
    curves.forEach((curve, k) => pair.append(new Option(curve.name, k)));
    pair.hidden = curves.length < 2;
    pair.onchange = () => {
      this.chart.curve = curves[pair.value];
      this.tell_figures();
      this.chart.draw();
      this.read();
    };
    element("fold").onclick = () => {
      const hidden = document.body.classList.toggle("folded");
      element("fold").setAttribute("aria-pressed", !hidden);
    };
    if (!curves.some((curve) => curve.figures.peak > 0)) element("fold").click();
    this.tell_figures();
  }

  tell_figures() {
    const { curve } = this.chart;
    const text = (value, base) => { const [factor, unit] = reading_unit(value, base); return `${(value * factor).toPrecision(3)} ${unit}`; };
    const facts = [["", `${digits(this.clock.duration)} s`]];
    if (curve && curve.figures.peak > 0) {
      const { contact_time, mean, peak, depth } = curve.figures;
      facts.push(["in contact", text(contact_time, "s")], ["mean", text(mean, "N")],
        ["peak", text(peak, "N")], ["deepest", text(depth, "m")]);
    } else facts.push(["no contact", ""]);
    const list = element("figures");
    list.textContent = "";
    for (const [name, value] of facts) {
      const item = document.createElement("span");
      item.append(name, name && value ? " " : "", Object.assign(document.createElement("b"), { textContent: value }));
      list.append(item);
    }
  }

  // The values at the time that is shown.
  read() {
    const { curve } = this.chart;
    if (!curve) return;
    const row = curve.row(this.time);
    for (const [column, base] of [["normal", "N"], ["friction", "N"], ["depth", "m"]]) {
      const most = curve[`${column === "friction" ? "normal" : column}_range`][1];
      const [factor, unit] = reading_unit(most, base);
      const decimals = most > 0 ? Math.max(0, 3 - Math.floor(Math.log10(most * factor))) : 0;
      element(column).textContent = `${(curve[column][row] * factor).toFixed(decimals)} ${unit}`;
    }
  }

  // Keys

  add_keys() {
    const names = this.cameras.names;
    const add = (pressed, says, act, repeats) => add_key({ keys: pressed, says, act, repeats });
    add([" "], "play or pause", () => this.toggle());
    add(["ArrowLeft", "ArrowRight"], "one frame back, on; ten with shift",
      (event) => this.go((event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? LEAP : 1)), true);
    add(["Home", "End"], "to the start, to the end",
      (event) => this.go_to(event.key === "Home" ? this.clock.start : this.clock.end));
    add(["ArrowUp", "ArrowDown"], "faster, slower", (event) => this.pace_by(event.key === "ArrowUp" ? 1 : -1), true);
    add(["l"], "play again and again", () => this.set_loop(!this.loop));
    add(names.map((_, k) => String(k + 1)), "cameras", (event) => this.cameras.look(names[Number(event.key) - 1]));
    add(["c"], "chart", () => element("fold").click());
    add_help_key();
  }

  // For films: draw the time t, or the frame with this number, at once.
  draw(t) {
    this.seek(t);
    this.viewer.render();
  }

  draw_frame(number) { this.draw(this.clock.start + number * this.step); }

  // The page without its controls.
  film(camera, chart) {
    this.pause();
    document.body.classList.add("film");
    document.body.classList.toggle("folded", !chart);
    element("key").open = true;
    this.viewer.set_3d_pane_size();
    this.cameras.look(camera);
  }
}

(async () => {
  try {
    const viewer = await start_viewer();
    const data = replay(viewer, await (await unpack("scene")).arrayBuffer());
    viewer.set_3d_pane_size();
    const panel = new Panel(viewer, data);
    viewer.render();
    // Loading may have taken seconds: start only now that the first frame is on the screen.
    requestAnimationFrame(() => {
      window.recording = panel;
      if (!still.matches) panel.play();
    });
  } catch (fault) {
    element("fault").textContent = `This recording cannot be shown: ${fault.message}`;
    window.recording_fault = true;
    throw fault;
  }
})();
