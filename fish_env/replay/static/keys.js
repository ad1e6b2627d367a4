"use strict";
Robofish.KEYS = [
  ["space", "play or pause"], ["← →", "0.2 s back or forward (with shift: 2 s)"],
  ["home, end", "to the start or the end"], ["↑ ↓", "faster or slower"],
  ["1 … 9", "show or hide a fish"], ["V", "next view"],
  ["A D W S", "turn the camera"], ["+ −", "nearer or farther"],
];

// What a key does; true where it did something.
Robofish.press = (replay, event) => {
  const { clock, stage } = replay;
  const step = event.shiftKey ? 2 : 0.2;
  const turn = (around, up, factor) => stage && stage.orbit(around, up, factor);
  const actions = {
    " ": () => clock.play(!clock.playing),
    ArrowLeft: () => clock.seek(clock.time - step),
    ArrowRight: () => clock.seek(clock.time + step),
    ArrowUp: () => replay.pace(1),
    ArrowDown: () => replay.pace(-1),
    Home: () => clock.seek(clock.start),
    End: () => clock.seek(clock.end),
    v: () => replay.nextView(),
    a: () => turn(-0.12, 0, 1),
    d: () => turn(0.12, 0, 1),
    w: () => turn(0, 0.1, 1),
    s: () => turn(0, -0.1, 1),
    "+": () => turn(0, 0, 0.88),
    "=": () => turn(0, 0, 0.88),
    "-": () => turn(0, 0, 1.14),
  };
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (/^[1-9]$/.test(key)) return replay.toggle(Number(key) - 1);
  if (!actions[key]) return false;
  actions[key]();
  return true;
};

// Keys belong to the page's own controls first: a focused button takes the space bar.
Robofish.listenToKeys = (replay, node) => {
  node.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    const own = event.target.type;
    if (tag === "SELECT" || tag === "TEXTAREA" || (tag === "INPUT" && own === "text")) return;
    const presses = tag === "BUTTON" || tag === "SUMMARY" || own === "checkbox";
    if (presses && (event.key === " " || event.key === "Enter")) return;
    if (Robofish.press(replay, event)) event.preventDefault();
  });
};
