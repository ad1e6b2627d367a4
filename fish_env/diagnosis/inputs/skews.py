"""When commands came, by the clock of the measurements: rate and offset between two clocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clock_changes import skew
from fish_env.diagnosis.inputs.orders import Stroke, explained, strokes_under, windows_of
from fish_env.diagnosis.inputs.responses import BEAT_S, simulate
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.recorded import recorded
from fish_env.inference.policy import POLICY
from fish_env.rigidbody.gridded import GridRun, averaged, gridded, grown
from fish_env.simulator import Simulator

SCALES = np.geomspace(0.18, 5.6, 230)
"""Rates of the commands' clock that are tried."""
STEP = 0.01
"""Relative step of the rates around which the beat decides."""
SPACING_S = 0.2
"""s between the points at which answers are compared."""
FINE_S = 0.01
"""s between the offsets of which an interval consists."""
Pair = tuple[float, float]
"""Scale and offset (s) that put the times of the commands right."""
Answers = dict[str, FloatArray]
"""Averages by channel."""
Moved = Callable[[float, int], tuple[Answers, Answers]]
"""Rate and run -> what was measured, and what the nominal fish does, by one clock."""


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

    def strokes(self, pair: Pair) -> dict[str, Stroke]:
        """Commanded strokes at other times, by the id of the run, of runs that show them."""
        return strokes_under(self.grids, [self.steps(run, pair) for run in self.runs])

    def left(self, pair: Pair, multiple: float = 1.0) -> float:
        """Mean log of what a multiple of the commanded beat leaves of the sway; 0 for nothing."""
        windows = windows_of(self.strokes(pair).values(), multiple)
        left = 1.01 - explained(windows, np.array([multiple]))
        return float(np.mean(np.log(left))) if len(left) else 0.0

    def windows(self, multiple: float = 1.0) -> int:
        """How many windows show the beat."""
        return sum(len(own.sway) for own in windows_of(self.strokes((1.0, 0.0)).values(), multiple))


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
    about = {True: [near], False: [near]} if near else _anywhere(aligner, simulator)
    found: list[Change] = []
    for right, pairs in about.items():
        _, (scale, offset) = min(_refined(aligner, pair, right) for pair in pairs)
        if abs(scale - 1.0) > CHECKS.smallest_ratio_error:
            value, shift = (scale, offset) if right else (1.0 / scale, offset / scale)
            found.append(skew(value, shift, of_commands=right))
    if True in about:
        begin = (1.0, about[True][0][1])
        _, (_, offset) = _refined(aligner, begin, True, (1.0,))
        found.append(skew(1.0, offset))
    return found


def _refined(
    aligner: Aligner, about: Pair, right: bool, factors: Sequence[float] | None = None
) -> tuple[float, Pair]:
    """What the beat leaves at the best scale and offset around some, on ever finer grids."""
    best, worth = about, np.inf
    for step, spacing in ((STEP, 0.2), (STEP / 4.0, 0.05)):
        centre = best
        scales = factors or [centre[0] * (1.0 + step * i) for i in range(-3, 4)]
        for scale in scales:
            for shift in centre[1] + spacing * np.arange(-3, 4):
                left = aligner.left((scale, float(shift)), 1.0 if right else 1.0 / scale)
                if left < worth - 1e-9:
                    best, worth = (scale, float(shift)), left
    return worth, best


def offset_near(aligner: Aligner, near_s: float) -> tuple[float, tuple[float, float], float]:
    """The offset of the commands close to some (s), its 95 % interval, and p of there being none.

    A window counts as one number, however many samples it has: they are not independent.
    """
    _, (_, best) = _refined(aligner, (1.0, near_s), True, (1.0,))
    shifts, count = best + FINE_S * np.arange(-30, 31), aligner.windows()
    left = np.array([aligner.left((1.0, float(shift))) for shift in shifts])
    within = shifts[count * (left - left.min()) < POLICY.interval_reach**2]
    gain = 0.5 * count * (aligner.left((1.0, 0.0)) - left.min())
    p = float(min(1.0, CHECKS.clocks_tried * np.exp(-gain)))
    return best, (float(within.min()), float(within.max())), p


def _anywhere(aligner: Aligner, simulator: Simulator) -> dict[bool, list[Pair]]:
    """Where the nominal fish does what was measured, by whether the measurements' clock is right.

    If it is, the fish swims under commands that are moved in time. If it is not, the fish swims as
    commanded, and it is the measurements that are moved.
    """
    runs = range(len(aligner.runs))
    measured = [_answers(grid, grid.channels) for grid in aligner.grids]
    swum = [_simulated(aligner, simulator, i, 1.0) for i in runs]

    def moved_commands(scale: float, i: int) -> tuple[Answers, Answers]:
        return measured[i], _simulated(aligner, simulator, i, scale)

    def moved_samples(scale: float, i: int) -> tuple[Answers, Answers]:
        grid = replace(aligner.grids[i], step_s=aligner.grids[i].step_s / scale)
        return _answers(grid, grid.channels), swum[i]

    commands = _best(aligner, moved_commands)
    samples = [(scale, scale * shift) for scale, shift in _best(aligner, moved_samples)]
    return {right: pairs for right, pairs in ((True, commands), (False, samples)) if pairs}


def _best(aligner: Aligner, moved: Moved) -> list[Pair]:
    """The best rates, and the times (s) by which measurements are later.

    Every rate is tried on the runs with most commands, and the most promising ones on all.
    """

    def scored(scale: float, runs: Sequence[int]) -> tuple[float, float]:
        scores, shifts = _by_shift([moved(scale, i) for i in runs])
        at = int(np.argmin(scores))
        return float(scores[at]), float(shifts[at])

    every = range(len(aligner.runs))
    telling = sorted(every, key=lambda i: -len(aligner.runs[i].commands.times_s))
    telling = telling[: CHECKS.runs_for_rates]
    found = {float(scale): scored(float(scale), telling) for scale in SCALES}
    if len(telling) < len(every):
        promising = sorted(found, key=lambda scale: found[scale])[: CHECKS.promising_rates]
        found = {scale: scored(scale, every) for scale in promising}
    return _apart(found)


def _apart(found: Mapping[float, tuple[float, float]]) -> list[Pair]:
    """The best rates that differ by more than the beat is asked about.

    Where commands change slowly, a rate can make up for an offset, and scores decide too little.

    Args:
        found: score and time (s) of each rate.
    """
    apart: list[Pair] = []
    for scale in sorted(found, key=lambda scale: found[scale]):
        score, shift = found[scale]
        near = any(abs(np.log(scale / other)) < 5.0 * STEP for other, _ in apart)
        if score < 0.0 and not near and len(apart) < CHECKS.rates_refined:
            apart.append((scale, shift))
    return apart


def _simulated(aligner: Aligner, simulator: Simulator, i: int, scale: float) -> Answers:
    """What the nominal fish answers to the commands of a run at another rate."""
    run, grid = aligner.runs[i], aligner.grids[i]
    swum = simulate(simulator, grid, aligner.steps(run, (scale, 0.0)), run.start == "rest")
    if swum is None:
        return {}
    # What was commanded after the last row is not known.
    late = grid.since_s > scale * float(run.time_s[-1] - run.time_s[0])
    return _answers(grid, {name: np.where(late, np.nan, values) for name, values in swum.items()})


def _answers(grid: GridRun, channels: Mapping[str, FloatArray]) -> Answers:
    """Averages over a beat of what answers to commands, every `SPACING_S`."""
    stride = grid.steps(BEAT_S)
    found = {}
    if "yaw" in channels and "yaw" in grid.channels:
        found["yaw"] = grown(channels["yaw"], stride)
    elif "r" in grid.channels:
        found["r"] = averaged(channels["r"], stride)
    if {"x", "y"} <= grid.channels.keys():
        found["speed"] = _varying(np.hypot(*(grown(channels[name], stride) for name in "xy")))
    elif "u" in grid.channels:
        found["u"] = _varying(averaged(channels["u"], stride))
    for name in ("roll", "pitch"):
        if name in grid.channels:
            found[name] = _varying(averaged(channels[name], stride))
    for name, angle in (("p", "roll"), ("q", "pitch")):
        if name in grid.channels and angle not in grid.channels:
            found[name] = averaged(channels[name], stride)
    return {name: _spaced(values, grid.step_s) for name, values in found.items()}


def _varying(values: FloatArray) -> FloatArray:
    """Values less their mean, which does not tell when commands came."""
    return values - np.nanmean(values) if np.isfinite(values).any() else values


def _spaced(values: FloatArray, step_s: float) -> FloatArray:
    """Values every step, interpolated every `SPACING_S`; NaN beside what is missing."""
    if len(values) < 2:
        return values
    count = int(step_s * (len(values) - 1) / SPACING_S + 1e-6) + 1
    at = SPACING_S / step_s * np.arange(count)
    spaced: FloatArray = np.interp(at, np.arange(len(values)), values)
    return spaced


def _by_shift(pairs: Sequence[tuple[Answers, Answers]]) -> tuple[FloatArray, FloatArray]:
    """Score of every time by which what was measured is later (low is good), and the times, s."""
    most = round(CHECKS.largest_clock_offset_s / SPACING_S)
    total = np.zeros(2 * most + 1)
    for name in dict.fromkeys(name for measured, _ in pairs for name in measured):
        error, size, count = (np.zeros(2 * most + 1) for _ in range(3))
        for m, g in pairs:
            if name in m and name in g and min(len(m[name]), len(g[name])) > 2:
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
