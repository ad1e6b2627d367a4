"use strict";
Robofish.PLOT_HEIGHT = 112;
Robofish.PAPER_WIDTH = 640;  // px; fits on A4 and on letter, upright

// Channels over time, one plot each, with a line at the present time.
Robofish.Plots = class {
  constructor(holder, clock) {
    this.holder = holder;
    this.clock = clock;
    this.plots = [];
    new ResizeObserver(() => this.resize()).observe(holder);
    // A page is laid out for paper without telling the observer: plots get a width that fits.
    window.addEventListener("beforeprint", () => this.resize(Robofish.PAPER_WIDTH));
    window.addEventListener("afterprint", () => this.resize());
  }

  show(tracks, specs, dark) {
    this.clear();
    this.tracks = tracks;
    const style = getComputedStyle(this.holder);
    this.ink = style.getPropertyValue("--rf-ink").trim();
    this.rule = style.getPropertyValue("--rf-rule").trim();
    this.plots = specs.filter((spec) => spec.shown).map((spec) => this.plot(spec, dark));
    this.update();
  }

  clear() {
    for (const { chart } of this.plots) chart.destroy();
    this.plots = [];
    this.holder.replaceChildren();
  }

  plot(spec, dark) {
    const values = Robofish.element("span", { class: "rf-values" });
    const title = Robofish.element("div", { class: "rf-title" }, spec.label, values);
    const box = Robofish.element("div", { class: "rf-plot", "data-channel": spec.channel }, title);
    this.holder.append(box);
    const chart = new uPlot(this.options(spec, dark), this.data(spec.channel), box);
    const cursor = Robofish.element("div", { class: "rf-now" });
    chart.over.append(cursor);
    this.scrub(chart);
    return { spec, chart, cursor, values, dark };
  }

  options(spec, dark) {
    const axis = {
      stroke: this.ink, grid: { stroke: this.rule, width: 1 }, ticks: { stroke: this.rule },
      font: "11px system-ui, sans-serif",
    };
    const dashes = { baseline: [7, 4], goal: [2, 3], measured: undefined };
    return {
      width: Math.max(this.holder.clientWidth, 200),
      height: Robofish.PLOT_HEIGHT,
      padding: [6, 18, 0, 0],
      // Places are known only once a plot is drawn, which is later than it is made.
      hooks: { draw: [() => this.update()] },
      legend: { show: false },
      cursor: { y: false, drag: { x: false, y: false }, sync: { key: "rf" }, points: { show: false } },
      scales: {
        x: { time: false, range: () => [this.clock.start, this.clock.end] },
        y: { dir: spec.down ? -1 : 1, range: (_, low, high) => Robofish.room(low, high) },
      },
      axes: [
        { ...axis, size: 26, space: 70, values: (_, times) => times.map((time) => `${time} s`) },
        { ...axis, size: 52, space: 22 },
      ],
      series: [
        {},
        ...this.tracks.map((track) => ({
          label: track.name, stroke: track.colour(dark), width: 1.6, dash: dashes[track.role],
          show: track.shown, points: { show: false },
        })),
      ],
    };
  }

  data(channel) {
    const tables = this.tracks.map((track) => {
      const values = track.channels[channel];
      const clean = (x) => (Number.isFinite(x) ? x : null);
      return [
        Array.from(track.time),
        values ? Array.from(values, clean) : new Array(track.time.length).fill(null),
      ];
    });
    return uPlot.join(tables);
  }

  // Pressing and drawing across a plot moves the time.
  scrub(chart) {
    const seek = (event) => {
      const left = event.clientX - chart.over.getBoundingClientRect().left;
      this.clock.seek(chart.posToVal(left, "x"));
    };
    chart.over.addEventListener("pointerdown", (event) => {
      chart.over.setPointerCapture(event.pointerId);
      seek(event);
    });
    chart.over.addEventListener("pointermove", (event) => {
      if (event.buttons) seek(event);
    });
  }

  resize(width = this.holder.clientWidth) {
    if (!width) return;
    for (const { chart } of this.plots) chart.setSize({ width, height: Robofish.PLOT_HEIGHT });
    this.update();
  }

  toggle(index) {
    for (const { chart } of this.plots) {
      chart.setSeries(index + 1, { show: this.tracks[index].shown });
    }
    this.update();
  }

  update() {
    for (const { spec, chart, cursor, values, dark } of this.plots) {
      cursor.style.transform = `translateX(${chart.valToPos(this.clock.time, "x")}px)`;
      const texts = this.tracks
        .filter((track) => track.shown && track.channels[spec.channel])
        .map((track) => {
          const value = track.valueAt(spec.channel, this.clock.time);
          const text = value === null ? "–" : value.toFixed(spec.label.includes("deg") ? 1 : 3);
          const node = Robofish.element("b", {}, text);
          node.style.color = track.colour(dark);
          return node;
        });
      values.replaceChildren(...texts);
    }
  }
};

// Axis ends with some room; a constant channel gets a band around it.
Robofish.room = (low, high) => {
  if (low === null || high === null) return [0, 1];
  const margin = Math.max(0.06 * (high - low), 1e-3 * Math.abs(high + low), 1e-3);
  return [low - margin, high + margin];
};
