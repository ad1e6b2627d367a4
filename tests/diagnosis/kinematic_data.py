"""Runs of a body that moves as it likes: angles with their rates, paths with their speeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.signal import lfilter

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.rigidbody.kinematics import euler_rates, rotations

NOISE = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("roll", "pitch", "yaw"), 0.005),
    **dict.fromkeys(("u", "v", "w", "p", "q", "r"), 0.01),
}
COMMANDS = CommandSteps(np.zeros(1), np.array([[0.0, 0.4, 1.5, 0.0, 0.0]]))
Channels = dict[str, np.ndarray]


SHAKE_HZ = 11.0


def motion(
    rng: np.random.Generator, seconds: float, shake: float = 0.0
) -> Callable[[np.ndarray], Channels]:
    """True channels at any times of one random motion.

    Args:
        rng: draws the motion.
        seconds: its duration.
        shake: yaw rate of a quick shaking (rad/s), at `SHAKE_HZ`.
    """
    sizes = np.array([[0.06, 0.25], [0.05, 0.3], [0.12, 0.5]])
    pace = np.array([1.5, 0.13]) * rng.uniform(0.8, 1.2, (3, 2)) * 2 * np.pi
    phase = rng.uniform(0, 2 * np.pi, (3, 2))
    drift = rng.uniform(-0.3, 0.3)
    fine = np.arange(0.0, 1.05 * seconds + 0.5, 1e-3)

    def attitude(t):
        wave = pace[None] * t[:, None, None] + phase[None]
        euler, rate = (sizes * np.sin(wave)).sum(2), (sizes * pace * np.cos(wave)).sum(2)
        euler[:, 2] += drift * t
        rate[:, 2] += drift
        quick = 2 * np.pi * SHAKE_HZ
        euler[:, 2] += shake / quick * np.sin(quick * t)
        rate[:, 2] += shake * np.cos(quick * t)
        return euler, np.linalg.solve(euler_rates(euler), rate[:, :, None])[:, :, 0]

    def speed(t):
        beat = np.sin(2 * np.pi * 1.5 * t + phase[0, 0])
        return np.column_stack(
            [0.25 + 0.1 * np.sin(0.9 * t) + 0.02 * beat, 0.04 * beat, 0.02 * np.sin(0.7 * t)]
        )

    over_ground = np.einsum("nij,nj->ni", rotations(attitude(fine)[0]), speed(fine))
    path = cumulative_simpson(over_ground, x=fine, axis=0, initial=0.0)

    def at(t):
        euler, omega = attitude(t)
        place = np.column_stack([np.interp(t, fine, column) for column in path.T])
        every = np.column_stack([place, euler, speed(t), omega])
        names = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")
        return dict(zip(names, every.T, strict=True))

    return at


def noise(rng: np.random.Generator, sd: float, n: int, colour: float) -> np.ndarray:
    """White noise, and as much again that is correlated over about half a second."""
    white = rng.normal(0.0, sd, n)
    if not colour:
        return white
    keep = 0.92
    slow = lfilter([np.sqrt(1 - keep**2)], [1.0, -keep], rng.normal(0.0, sd, n + 200))[200:]
    return white + colour * slow


def measured(
    seed: int,
    channels: tuple[str, ...] = ("roll", "pitch", "yaw", "p", "q", "r"),
    runs: int = 3,
    seconds: float = 12.0,
    rate: float = 25.0,
    colour: float = 0.0,
    clock: float = 1.0,
    late: Mapping[str, float] | None = None,
    gain: Mapping[str, float] | None = None,
    bias: Mapping[str, float] | None = None,
    start: str = "unknown",
    shake: float = 0.0,
) -> Dataset:
    """A dataset of random motions as imperfect sensors see it."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate)) / rate
    made = []
    for number in range(runs):
        at = motion(rng, seconds, shake)
        seen = {}
        for name in channels:
            true = at(np.maximum(time * clock - (late or {}).get(name, 0.0), 0.0))[name]
            values = (gain or {}).get(name, 1.0) * true + (bias or {}).get(name, 0.0)
            seen[name] = values + noise(rng, NOISE[name], len(time), colour)
        made.append(Run(f"r{number}", time, seen, COMMANDS, start, None))
    return Dataset("made", "zheng-2021-a", tuple(made))
