"use strict";
// The one time that fish, plots and slider share.
Robofish.Clock = class {
  constructor() {
    this.time = 0;
    this.start = 0;
    this.end = 1;
    this.speed = 1;
    this.playing = false;
    this.listeners = [];
    this.last = null;
  }

  listen(listener) {
    this.listeners.push(listener);
  }

  tell() {
    for (const listener of this.listeners) listener();
  }

  range(start, end) {
    this.start = start;
    this.end = end;
    this.seek(start);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.tell();
  }

  play(wanted) {
    if (wanted === this.playing) return;
    if (wanted && this.time >= this.end - 1e-6) this.time = this.start;
    this.playing = wanted;
    this.last = null;
    if (wanted) requestAnimationFrame((now) => this.tick(now));
    this.tell();
  }

  tick(now) {
    if (!this.playing) return;
    if (this.last !== null) {
      // A tab that was hidden must not jump.
      const passed = Math.min((now - this.last) / 1000, 0.1);
      this.time = Math.min(this.time + this.speed * passed, this.end);
    }
    this.last = now;
    if (this.time >= this.end) this.playing = false;
    else requestAnimationFrame((next) => this.tick(next));
    this.tell();
  }
};
