"""A run's own free numbers: where it starts, its tail's phase, and how fast its tail beats."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from fish_env.arrays import FloatArray
from fish_env.identification.runs import FREQUENCY, RunData
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.state import BASE_STATES

POSE = ("x", "y", "z", "roll", "pitch", "yaw")
RATES = ("u", "v", "w", "p", "q", "r")
PHASE, PACE = "phase", "pace"
UNITS = dict.fromkeys("xyz", 2e-3) | dict.fromkeys(("roll", "pitch", "yaw"), 0.02)
UNITS |= dict.fromkeys("uvw", 5e-3) | dict.fromkeys("pqr", 0.05) | {PHASE: 0.3, PACE: 0.01}
"""Sizes (m, rad, m/s, rad/s, 1) that matter; differences and longest steps are counted in them."""
PRIOR_SD = {"u": 0.03, "v": 0.02, "w": 0.02, "p": 0.3, "q": 0.3, "r": 0.3, PACE: 0.02}
"""One sigma of what is known of them beforehand; of the others nothing is. Tails of one fish beat
some hundredths faster or slower from run to run."""
SHOWN_BY = {"u": "xu", "v": "yv", "w": "zw", "p": ("roll", "p"), "q": ("pitch", "q")}
SHOWN_BY |= {"r": ("yaw", "r")}
"""Channels that show a rate."""
BEGINNING_S = 2.0
"""Beginning of a run from which pose and rates are guessed (s)."""
FEWEST = 6
_PHASE_ROW = BASE_STATES.index("tail_phase")


@dataclass(frozen=True, eq=False)
class OwnNumbers:
    """What is free in one run, K numbers.

    Attributes:
        names: of :data:`POSE`, :data:`RATES`, ``phase``, and ``pace``, the tail's frequency over
            that of the model, one in the mean over runs.
        guess: (K,) first guess; of the pace, measured over commanded frequency.
        centre: (K,) centre of the prior.
    """

    names: tuple[str, ...]
    guess: FloatArray
    centre: FloatArray

    @cached_property
    def units(self) -> FloatArray:
        """(K,) sizes that matter."""
        return np.array([UNITS[name] for name in self.names])

    @cached_property
    def precision(self) -> FloatArray:
        """(K,) one over the prior's standard deviation, zero where nothing is known."""
        return np.array([1.0 / PRIOR_SD.get(name, np.inf) for name in self.names])

    def states(self, run: RunData, values: FloatArray) -> FloatArray:
        """Base states (18, N) at the start of a run for numbers (K, N)."""
        count = values.shape[1]
        states = np.repeat(run.state0[:, None], count, axis=1)
        known = dict(zip(self.names, values, strict=True))
        euler = np.repeat(_euler(run)[:, None], count, axis=1)
        for i, name in enumerate(POSE):
            if name in known:
                rows = states if i < 3 else euler
                rows[i % 3] = known[name]
        states[3:7] = quaternion_from_euler(euler.T).T
        for i, name in enumerate(RATES):
            if name in known:
                states[7 + i] = known[name]
        if PHASE in known:
            states[_PHASE_ROW] = known[PHASE]
        return states

    def pace(self, values: FloatArray) -> FloatArray:
        """Tail frequency over that of the model (N,) of numbers (K, N)."""
        return np.asarray(values[self.names.index(PACE)])


def own_numbers(run: RunData, channels: Iterable[str], pace: float) -> OwnNumbers:
    """What is free in a run.

    A pose is free where it is measured, a rate where a channel shows it and the run does not start
    from rest, a phase where it is unknown. What no channel shows stays as it is: a free pitch that
    no camera sees would stand in for other errors.

    Args:
        run: the run.
        channels: measured channels.
        pace: measured tail frequency over the commanded one, about.
    """
    measured = tuple(channels)
    names = [name for name in POSE if name in measured]
    if run.swimming:
        names += [name for name in RATES if any(c in measured for c in SHOWN_BY[name])]
    if not run.phase_known:
        names.append(PHASE)
    names.append(PACE)
    found = _beginning(run, measured, pace)
    guess = np.array([found.get(name, 0.0) for name in names])
    guess[-1] = pace
    centre = guess.copy()
    centre[-1] = 1.0
    for name in ("v", "w"):  # a slope along a fish that sways says little
        if name in names:
            centre[names.index(name)] = 0.0
    return OwnNumbers(tuple(names), guess, centre)


def _euler(run: RunData) -> FloatArray:
    """Roll, pitch, yaw (rad) of a run's initial state."""
    w, x, y, z = run.state0[3:7]
    return np.asarray(Rotation.from_quat([x, y, z, w]).as_euler("ZYX")[::-1])


def _beginning(run: RunData, channels: tuple[str, ...], pace: float) -> dict[str, float]:
    """Pose and rates by a line and the beat's sine through the first seconds of each channel."""
    values = dict(zip(POSE, (*run.state0[:3], *_euler(run)), strict=True))
    if not run.swimming:
        return values
    slopes = dict.fromkeys(POSE, 0.0)
    early = run.clock <= BEGINNING_S
    frequency = pace * run.commands[1][0, FREQUENCY]
    for i, name in enumerate(channels):
        good = early & np.isfinite(run.measured[:, i])
        if good.sum() < FEWEST or name not in (*POSE, *RATES):
            continue
        time = run.clock[good]
        beat = 2.0 * np.pi * frequency * time
        basis = np.column_stack([np.ones_like(time), time, np.sin(beat), np.cos(beat)])
        seen = run.measured[good, i]
        seen = np.unwrap(seen) if name in ("roll", "yaw") else seen
        level, slope, _, wave = np.linalg.lstsq(basis, seen, rcond=None)[0]
        values[name] = float(level if name in POSE else level + wave)
        slopes[name] = float(slope)
    angles = [values["yaw"], values["pitch"], values["roll"]]
    ground = [slopes[name] for name in "xyz"]
    u, v, w = Rotation.from_euler("ZYX", angles).apply(ground, inverse=True)
    rates = {"u": max(float(u), 0.0), "v": 0.0 * v, "w": 0.0 * w}
    rates |= {"p": slopes["roll"], "q": slopes["pitch"], "r": slopes["yaw"]}
    return {**rates, **values}
