"use strict";
// Everything of the replay lives in this one name; the libraries are THREE and uPlot.
const Robofish = { replays: [] };

// Base64 of little-endian float32, as the page's writer packs arrays.
Robofish.floats = (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
};

// One fish over time, unpacked.
Robofish.Track = class {
  constructor(packed) {
    for (const key of ["name", "role", "colours", "notes", "start", "step"]) this[key] = packed[key];
    for (const key of ["position", "quaternion", "tail", "block", "time"]) {
      this[key] = Robofish.floats(packed[key]);
    }
    this.channels = Object.fromEntries(
      Object.entries(packed.channels).map(([name, text]) => [name, Robofish.floats(text)]),
    );
    this.count = this.tail.length;
    this.end = this.start + this.step * (this.count - 1);
    this.shown = true;
  }

  colour(dark) {
    return this.colours[dark ? 1 : 0];
  }

  // Pose at a time, between frames: position, attitude, tail angle, block place and angle.
  at(time) {
    const place = Math.min(Math.max((time - this.start) / this.step, 0), this.count - 1);
    const index = Math.min(Math.floor(place), this.count - 2);
    const part = place - index;
    const mix = (values, width) =>
      Array.from({ length: width }, (_, k) => {
        const first = values[index * width + k];
        return first + part * (values[(index + 1) * width + k] - first);
      });
    return {
      frame: place,
      position: mix(this.position, 3),
      quaternion: this.attitude(index, part),
      tail: mix(this.tail, 1)[0],
      block: mix(this.block, 4),
    };
  }

  // Scalar first. Neighbours may differ in sign, which is the same attitude.
  attitude(index, part) {
    const a = this.quaternion.subarray(4 * index, 4 * index + 4);
    const b = this.quaternion.subarray(4 * index + 4, 4 * index + 8);
    const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
    const mixed = [0, 1, 2, 3].map((k) => (1 - part) * a[k] + part * sign * b[k]);
    const length = Math.hypot(...mixed);
    return mixed.map((value) => value / length);
  }

  // The last sample of a channel at or before a time; null where there is none.
  valueAt(channel, time) {
    const values = this.channels[channel];
    if (!values || time < this.time[0] - 1e-6) return null;
    let low = 0;
    let high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time + 1e-6) low = middle;
      else high = middle - 1;
    }
    return Number.isFinite(values[low]) ? values[low] : null;
  }
};

Robofish.element = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "class") node.className = value;
    else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
};

Robofish.darkQuery = window.matchMedia("(prefers-color-scheme: dark)");
