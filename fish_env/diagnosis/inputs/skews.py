"""When commands came, by the clock of the measurements: rate and offset between two clocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clock_changes import skew
from fish_env.diagnosis.inputs.orders import Stroke, explained, stroke_of, windows_of
from fish_env.diagnosis.inputs.responses import BEAT_S, Simulated, simulate
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.recorded import recorded
from fish_env.rigidbody.gridded import GridRun, averaged, gridded, grown
from fish_env.simulator import Simulator

SCALES = np.geomspace(0.18, 5.6, 230)
"""Rates of the commands' clock that are tried."""
SPACING_S = 0.2
"""s between the points at which answers are compared."""
Pair = tuple[float, float]
"""Scale and offset (s) that put the times of the commands right."""


@dataclass(frozen=True, eq=False)
class Aligner:
    """Runs on their grids, with commands that may be moved in time.

    Attributes:
        runs: as they are logged.
        grids: their channels.
    """

    runs: tuple[Run, ...]
    grids: tuple[GridRun, ...]

    @classmethod
    def of(cls, dataset: Dataset) -> Aligner | None:
        """For a dataset; None if its commands hardly change, so that nothing shows when."""
        fewest = CHECKS.fewest_command_changes
        if not any(len(run.commands.times_s) > fewest for run in dataset.runs):
            return None
        return cls(dataset.runs, gridded(recorded(dataset)))

    def steps(self, run: Run, pair: Pair) -> CommandSteps:
        """Commands of a run at other times."""
        begin = float(run.time_s[0])
        times = begin + pair[0] * (run.commands.times_s - begin) + pair[1]
        return CommandSteps(times, run.commands.values)

    def strokes(self, pair: Pair) -> list[Stroke]:
        """Commanded strokes of all runs at other times."""
        found = [
            stroke_of(grid, self.steps(run, pair))
            for grid, run in zip(self.grids, self.runs, strict=True)
        ]
        return [stroke for stroke in found if stroke is not None]

    def left(self, pair: Pair, multiple: float = 1.0) -> float:
        """Mean log of what a multiple of the commanded beat leaves of the sway; 0 for nothing."""
        windows = windows_of(self.strokes(pair), multiple)
        left = 1.01 - explained(windows, np.array([multiple]))
        return float(np.mean(np.log(left))) if len(left) else 0.0

    def windows(self, multiple: float = 1.0) -> int:
        """How many windows show the beat."""
        return sum(len(own.sway) for own in windows_of(self.strokes((1.0, 0.0)), multiple))


def near_skew(aligner: Aligner) -> Pair | None:
    """Scale and offset close to none that suit the beat much better; None if none does."""
    tried = [(1.0, 0.1 * i) for i in range(-10, 11)] + [(1 + 0.01 * i, 0.0) for i in range(-6, 7)]
    left = {pair: aligner.left(pair) for pair in tried}
    best = min(tried, key=lambda pair: left[pair])
    return None if left[best] > left[1.0, 0.0] - CHECKS.least_skew_gain else best


def skews(aligner: Aligner, simulator: Simulator, near: Pair | None) -> list[Change]:
    """Skews and offsets that the data may have.

    Args:
        aligner: the runs.
        simulator: the nominal fish.
        near: where to look; anywhere if None.
    """
    about = near or _anywhere(aligner, simulator)
    if about is None:
        return []
    found: list[Change] = []
    # Either the clock of the measurements is right, or that of the commands.
    for right in (True, False):
        scale, offset = _refined(aligner, about, right)
        if abs(scale - 1.0) > CHECKS.smallest_ratio_error:
            value, shift = (scale, offset) if right else (1.0 / scale, offset / scale)
            found.append(skew(value, shift, of_commands=right))
    found.append(skew(1.0, _refined(aligner, (1.0, about[1]), True, (1.0,))[1]))
    return found


def _refined(
    aligner: Aligner, about: Pair, right: bool, factors: Sequence[float] | None = None
) -> Pair:
    """The best scale and offset around some, by the beat, on ever finer grids."""
    best, worth = about, np.inf
    for step, spacing in ((0.01, 0.2), (0.0025, 0.05)):
        centre = best
        scales = factors or [centre[0] * (1.0 + step * i) for i in range(-3, 4)]
        for scale in scales:
            for shift in centre[1] + spacing * np.arange(-3, 4):
                left = aligner.left((scale, float(shift)), 1.0 if right else 1.0 / scale)
                if left < worth - 1e-9:
                    best, worth = (scale, float(shift)), left
    return best


def _anywhere(aligner: Aligner, simulator: Simulator) -> Pair | None:
    """Where the nominal fish, under commands moved in time, does what was measured."""
    measured = [_answers(grid, grid.channels) for grid in aligner.grids]
    best, worth = None, 0.0
    for scale in SCALES:
        swum = [
            _simulated(aligner, simulator, i, (float(scale), 0.0)) for i in range(len(aligner.runs))
        ]
        scores, shifts = _by_shift(measured, swum)
        at = int(np.argmin(scores))
        if scores[at] < worth:
            best, worth = (float(scale), float(shifts[at])), float(scores[at])
    return best


def _simulated(aligner: Aligner, simulator: Simulator, i: int, pair: Pair) -> dict[str, FloatArray]:
    run, grid = aligner.runs[i], aligner.grids[i]
    swum = simulate(simulator, grid, aligner.steps(run, pair), run.start == "rest")
    if swum is None:
        return {}
    end = float(run.time_s[0]) + pair[0] * float(run.time_s[-1] - run.time_s[0])
    # What was commanded after the last row is not known.
    late = grid.begin_s + grid.since_s > end
    return _answers(grid, {name: np.where(late, np.nan, values) for name, values in swum.items()})


def _answers(grid: GridRun, channels: Simulated | object) -> dict[str, FloatArray]:
    """Averages over a beat of what answers to commands, every `SPACING_S`."""
    assert isinstance(channels, dict)
    stride, every = grid.steps(BEAT_S), grid.steps(SPACING_S)
    found = {}
    if "yaw" in channels and "yaw" in grid.channels:
        found["yaw"] = grown(channels["yaw"], stride)
    elif "r" in grid.channels:
        found["r"] = averaged(channels["r"], stride)
    if {"x", "y"} <= grid.channels.keys():
        found["speed"] = np.hypot(*(grown(channels[name], stride) for name in "xy"))
    elif "u" in grid.channels:
        found["u"] = averaged(channels["u"], stride)
    for name in ("roll", "pitch"):
        if name in grid.channels:
            values = averaged(channels[name], stride)
            found[name] = values - np.nanmean(values) if np.isfinite(values).any() else values
    for name, angle in (("p", "roll"), ("q", "pitch")):
        if name in grid.channels and angle not in grid.channels:
            found[name] = averaged(channels[name], stride)
    return {name: values[::every] for name, values in found.items()}


def _by_shift(
    measured: Sequence[dict[str, FloatArray]], swum: Sequence[dict[str, FloatArray]]
) -> tuple[FloatArray, FloatArray]:
    """Score of every offset of the commands (low is good), and the offsets, s."""
    most = round(CHECKS.largest_clock_offset_s / SPACING_S)
    total = np.zeros(2 * most + 1)
    for name in dict.fromkeys(name for answers in measured for name in answers):
        error, size, count = (np.zeros(2 * most + 1) for _ in range(3))
        for m, g in zip(measured, swum, strict=True):
            if name in m and name in g and len(m[name]) > 2:
                cross, own, other, known = _correlated(m[name], g[name], most)
                error += own + other - 2.0 * cross
                size += own + other
                count += known
        disagreement = error / np.maximum(size, 1e-12)
        logs = np.log(np.clip(disagreement, 0.0, 2.0) + CHECKS.best_disagreement)
        total += count * SPACING_S * logs
    return total, SPACING_S * np.arange(-most, most + 1, dtype=np.float64)


def _correlated(m: FloatArray, g: FloatArray, most: int) -> tuple[FloatArray, ...]:
    """Sums over samples of m g, m^2, g^2 and 1 where g is later by each number of samples."""
    length = 1 << int(np.ceil(np.log2(len(m) + len(g))))

    def sums(a: FloatArray, b: FloatArray) -> FloatArray:
        product = np.fft.irfft(np.fft.rfft(a, length) * np.conj(np.fft.rfft(b, length)), length)
        return np.concatenate([product[-most:], product[: most + 1]])

    here, there = np.isfinite(m).astype(float), np.isfinite(g).astype(float)
    m, g = np.where(here > 0.0, m, 0.0), np.where(there > 0.0, g, 0.0)
    return sums(m, g), sums(m**2, there), sums(here, g**2), np.round(sums(here, there))
