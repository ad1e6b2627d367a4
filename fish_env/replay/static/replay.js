"use strict";
// One replay: its controls, and what connects clock, stage and plots.
Robofish.SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];
Robofish.VIEWS = { follow: "Follow", overview: "Overview", top: "Top", side: "Side" };

Robofish.Replay = class {
  constructor(root) {
    this.root = root;
    this.content = JSON.parse(document.getElementById(root.dataset.source).textContent);
    this.wholePage = root.dataset.wholePage === "yes";
    this.clock = new Robofish.Clock();
    this.build();
    this.plots = new Robofish.Plots(this.parts.plots, this.clock);
    this.stage = this.makeStage();
    this.clock.listen(() => this.update());
    Robofish.darkQuery.addEventListener("change", () => this.show(this.index, true));
    Robofish.listenToKeys(this, this.wholePage ? document : root);
    this.show(0);
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (this.wholePage && !calm) this.clock.play(true);
  }

  makeStage() {
    try {
      const stage = new Robofish.Stage(this.parts.view, this.content.shape);
      stage.onDraw = (scale, cell) => this.caption(scale, cell);
      return stage;
    } catch (error) {
      const text = "This browser shows no 3-D pictures (WebGL is off); the plots work without.";
      this.parts.view.replaceChildren(Robofish.element("p", { class: "rf-sorry" }, text));
      return null;
    }
  }

  build() {
    const make = Robofish.element;
    const parts = {};
    parts.groups = make("select", { "aria-label": "run" });
    for (const [i, group] of this.content.groups.entries()) {
      parts.groups.append(make("option", { value: i }, group.name));
    }
    parts.groups.addEventListener("change", () => this.show(Number(parts.groups.value)));
    parts.tracks = make("div", { class: "rf-tracks", role: "group", "aria-label": "fish shown" });
    parts.caption = make("div", { class: "rf-caption" });
    parts.views = make("div", { class: "rf-views", role: "group", "aria-label": "views" });
    for (const [view, label] of Object.entries(Robofish.VIEWS)) {
      const look = () => this.look(view);
      parts.views.append(make("button", { type: "button", "data-view": view, onclick: look }, label));
    }
    parts.view = make("div", { class: "rf-view" }, parts.views, parts.caption);
    parts.plots = make("div", { class: "rf-plots" });
    this.buildBar(parts);
    parts.choice = make("div", { class: "rf-choice" });
    parts.notes = make("p", { class: "rf-notes" });
    const keys = make("dl", { class: "rf-keys" });
    for (const [key, meaning] of Robofish.KEYS) {
      keys.append(make("dt", {}, key), make("dd", {}, meaning));
    }
    const runs = make("label", { class: "rf-run" }, "Run ", parts.groups);
    runs.hidden = this.content.groups.length < 2;
    const top = make("div", { class: "rf-top" }, runs, parts.tracks);
    const more = make(
      "div", { class: "rf-more" },
      make("details", {}, make("summary", {}, "Channels"), parts.choice),
      make("details", {}, make("summary", {}, "Keys"), keys),
      parts.notes,
    );
    this.parts = parts;
    this.root.setAttribute("tabindex", "0");
    this.root.setAttribute("role", "group");
    this.root.setAttribute("aria-label", "replay of swimming fish");
    this.root.replaceChildren(top, parts.view, parts.bar, parts.plots, more);
  }

  buildBar(parts) {
    const make = Robofish.element;
    parts.play = make("button", { type: "button", class: "rf-play" }, "▶");
    parts.play.addEventListener("click", () => this.clock.play(!this.clock.playing));
    parts.slider = make("input", { type: "range", step: "any", "aria-label": "time" });
    parts.slider.addEventListener("input", () => this.clock.seek(Number(parts.slider.value)));
    parts.time = make("output", { class: "rf-time" });
    parts.speed = make("select", { "aria-label": "speed" });
    for (const speed of Robofish.SPEEDS) {
      parts.speed.append(make("option", { value: speed }, `${speed} ×`));
    }
    parts.speed.value = "1";
    parts.speed.addEventListener("change", () => {
      this.clock.speed = Number(parts.speed.value);
    });
    parts.bar = make("div", { class: "rf-bar" }, parts.play, parts.slider, parts.time, parts.speed);
  }

  // Shows a group; `again` keeps time, camera and what is hidden, for a change of colours.
  show(index, again = false) {
    const packed = this.content.groups[index];
    const moment = this.clock.time;
    const dark = Robofish.darkQuery.matches;
    if (!again) {
      this.clock.play(false);
      this.index = index;
      this.parts.groups.value = String(index);
      this.tracks = packed.tracks.map((track) => new Robofish.Track(track));
      this.specs = this.specs ? this.sameChoice(packed.plots) : packed.plots.map((p) => ({ ...p }));
    }
    this.fillTracks(dark);
    this.fillChoice(dark);
    const start = Math.min(...this.tracks.map((track) => track.start));
    this.clock.range(start, Math.max(...this.tracks.map((track) => track.end)));
    this.parts.slider.min = this.clock.start;
    this.parts.slider.max = this.clock.end;
    this.parts.notes.textContent = this.notes();
    this.plots.show(this.tracks, this.specs, dark);
    this.stage?.show(this.tracks, dark);
    if (again) this.clock.seek(moment);
    else if (this.stage) this.look(this.stage.firstView());
  }

  sameChoice(plots) {
    const shown = new Set(this.specs.filter((spec) => spec.shown).map((spec) => spec.channel));
    return plots.map((plot) => ({ ...plot, shown: shown.has(plot.channel) }));
  }

  notes() {
    const owners = new Map();
    for (const track of this.tracks) {
      for (const note of track.notes) owners.set(note, [...(owners.get(note) ?? []), track.name]);
    }
    const sentence = (words) => words[0].toUpperCase() + words.slice(1);
    return [...owners].map(([note, names]) => `${sentence(note)} (${names.join(", ")}).`).join(" ");
  }

  fillTracks(dark) {
    const make = Robofish.element;
    const labels = this.tracks.map((track, i) => {
      const box = make("input", { type: "checkbox" });
      box.checked = track.shown;
      box.addEventListener("change", () => this.toggle(i));
      const mark = make("span", { class: `rf-mark rf-${track.role}` });
      mark.style.borderColor = track.colour(dark);
      return make("label", {}, box, mark, track.name);
    });
    this.parts.tracks.replaceChildren(...labels);
  }

  fillChoice(dark) {
    const make = Robofish.element;
    const labels = this.specs.map((spec) => {
      const box = make("input", { type: "checkbox" });
      box.checked = spec.shown;
      box.addEventListener("change", () => {
        spec.shown = box.checked;
        this.plots.show(this.tracks, this.specs, dark);
      });
      return make("label", {}, box, spec.label);
    });
    this.parts.choice.replaceChildren(...labels);
  }

  toggle(i) {
    const track = this.tracks[i];
    if (!track) return false;
    track.shown = !track.shown;
    this.parts.tracks.querySelectorAll("input")[i].checked = track.shown;
    this.plots.toggle(i);
    this.stage?.wish();
    return true;
  }

  look(view) {
    this.view = view;
    for (const button of this.parts.views.children) {
      button.setAttribute("aria-pressed", String(button.dataset.view === view));
    }
    this.stage?.look(view);
  }

  nextView() {
    const views = Object.keys(Robofish.VIEWS);
    this.look(views[(views.indexOf(this.view) + 1) % views.length]);
  }

  pace(step) {
    const index = Robofish.SPEEDS.indexOf(this.clock.speed) + step;
    this.clock.speed = Robofish.SPEEDS[Math.min(Math.max(index, 0), Robofish.SPEEDS.length - 1)];
    this.parts.speed.value = String(this.clock.speed);
  }

  caption(scale, cell) {
    const grid = `grid ${Number(cell.toPrecision(2))} m`;
    const text = scale > 1.05 ? `${grid} · fish drawn ${scale.toFixed(1)} × larger` : grid;
    if (this.parts.caption.textContent !== text) this.parts.caption.textContent = text;
  }

  update() {
    const { clock, parts } = this;
    const label = clock.playing ? "pause" : "play";
    if (parts.play.getAttribute("aria-label") !== label) {
      parts.play.setAttribute("aria-label", label);
      parts.play.textContent = clock.playing ? "❚❚" : "▶";
    }
    parts.slider.value = clock.time;
    const time = `${clock.time.toFixed(1)} / ${clock.end.toFixed(1)} s`;
    if (parts.time.textContent !== time) parts.time.textContent = time;
    parts.slider.setAttribute("aria-valuetext", `${clock.time.toFixed(1)} seconds`);
    this.plots.update();
    this.stage?.update(clock.time);
  }
};

for (const root of document.querySelectorAll(".rf-replay")) {
  Robofish.replays.push(new Robofish.Replay(root));
}
