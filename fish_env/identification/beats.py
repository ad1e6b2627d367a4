"""How fast the tail beats, by the swaying of the hull alone, against what was commanded.

The physics does not enter: whatever the tail does to the water, hull and tail sway at one
frequency. A fit takes commands for granted, and a beat that is off by a hundredth is out of step
after a minute; one that is off differently in every run is no effect of any catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import chdtrc, fdtrc

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.policy import IDENTIFICATION
from fish_env.params.schema import FishParams

SWAYING = ("r", "yaw", "v", "y")
"""Channels in which a beat shows, the clearest first."""
_AMPLITUDE, _FREQUENCY = (list(COMMANDS).index(f"tail_{n}") for n in ("amplitude", "frequency"))


@dataclass(frozen=True)
class Beat:
    """The beat of a stretch of constant commands.

    Attributes:
        run: id of the run.
        row: of its commands.
        commanded: frequency (Hz).
        measured: frequency (Hz).
        sd: standard error of the latter (Hz).
    """

    run: str
    row: int
    commanded: float
    measured: float
    sd: float

    @property
    def ratio(self) -> float:
        """Measured over commanded."""
        return self.measured / self.commanded


def beats_of(dataset: Dataset) -> tuple[Beat, ...]:
    """The beats of all stretches that are long enough and sway clearly enough."""
    channel = next((name for name in SWAYING if name in dataset.channels), None)
    if channel is None:
        return ()
    return tuple(beat for run in dataset.runs for beat in _beats_of(run, channel))


def _beats_of(run: Run, channel: str) -> Iterator[Beat]:
    ends = np.append(run.commands.times_s[1:], run.time_s[-1])
    values, known = run.channels[channel], IDENTIFICATION
    for row, (begin, end) in enumerate(zip(run.commands.times_s, ends, strict=True)):
        amplitude, commanded = run.commands.values[row, [_AMPLITUDE, _FREQUENCY]]
        inside = (run.time_s >= begin) & (run.time_s <= end) & np.isfinite(values)
        beats = (end - begin) * commanded
        enough = inside.sum() >= known.fewest_beat_samples and beats >= known.fewest_beats
        if amplitude <= 0.0 or not enough:
            continue
        sway = np.unwrap(values[inside]) if channel == "yaw" else values[inside]
        found = frequency_of(run.time_s[inside], sway, float(commanded))
        if found is not None:
            yield Beat(run.id, row, float(commanded), *found)


def frequency_of(t: FloatArray, sway: FloatArray, near: float) -> tuple[float, float] | None:
    """Frequency (Hz) of the sine that leaves least, and its standard error; None if none is clear.

    Args:
        t: (n,) times (s).
        sway: (n,) values, on top of whatever changes slowly.
        near: about what is looked for (Hz).
    """
    length = t[-1] - t[0]
    lowest, highest = IDENTIFICATION.lowest_beat_ratio, IDENTIFICATION.highest_beat_ratio
    at = 2.0 * (t - t[0]) / length - 1.0
    slow = np.polynomial.legendre.legvander(at, int(np.clip(length * near / 3.0, 2, 8)))

    def fitted(frequency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        angle = 2.0 * np.pi * frequency * (t - t.mean())
        columns = np.column_stack([slow, np.cos(angle), np.sin(angle)])
        weights = np.linalg.lstsq(columns, sway, rcond=None)[0]
        return columns, weights, sway - columns @ weights

    def left(frequency: float) -> float:
        residuals = fitted(frequency)[2]
        return float(residuals @ residuals)

    grid = np.arange(lowest * near, highest * near, 0.1 / length)
    best = float(grid[np.argmin([left(f) for f in grid])])
    best = float(minimize_scalar(left, bounds=(best - 0.1 / length, best + 0.1 / length)).x)
    columns, weights, residuals = fitted(best)
    freedom = len(t) - columns.shape[1] - 1
    alone = sway - slow @ np.linalg.lstsq(slow, sway, rcond=None)[0]
    gain = float(alone @ alone - residuals @ residuals)
    variance = float(residuals @ residuals) / freedom * _colour(residuals)
    # The best of as many frequencies as the range tells apart.
    looks = (highest - lowest) * near * length
    if looks * fdtrc(3, freedom, gain / 3.0 / variance) > IDENTIFICATION.sway_level:
        return None
    turning = 2.0 * np.pi * (t - t.mean())
    slope = turning * (weights[-1] * columns[:, -2] - weights[-2] * columns[:, -1])
    own = slope - columns @ np.linalg.lstsq(columns, slope, rcond=None)[0]
    return best, float(np.sqrt(variance / (own @ own)))


def _colour(residuals: FloatArray) -> float:
    """Factor by which neighbours that are alike widen what is estimated from them."""
    alike = float(residuals[1:] @ residuals[:-1] / max(float(residuals @ residuals), 1e-300))
    alike = float(np.clip(alike, 0.0, 0.9))
    return (1.0 + alike) / (1.0 - alike)


def by_run(beats: Sequence[Beat]) -> dict[str, tuple[float, float]]:
    """Run -> measured over commanded frequency, and its standard error."""
    found = {}
    for run in dict.fromkeys(beat.run for beat in beats):
        own = [beat for beat in beats if beat.run == run]
        weights = np.array([(beat.commanded / beat.sd) ** 2 for beat in own])
        ratio = float(weights @ [beat.ratio for beat in own] / weights.sum())
        found[run] = (ratio, float(weights.sum() ** -0.5))
    return found


def uneven(beats: Sequence[Beat]) -> bool:
    """Whether runs beat at different multiples of the commanded frequency."""
    pairs = np.array(list(by_run(beats).values())).reshape(-1, 2)
    if len(pairs) < 2:
        return False
    ratios, errors = pairs.T
    weights = errors**-2
    square = float(weights @ (ratios - weights @ ratios / weights.sum()) ** 2)
    by_chance = chdtrc(len(pairs) - 1, square) > IDENTIFICATION.uneven_beats_level
    return bool(np.std(ratios, ddof=1) > IDENTIFICATION.uneven_beats and not by_chance)


def with_measured_beats(dataset: Dataset, fish: FishParams) -> Dataset:
    """The dataset as if this fish had been commanded to beat at the measured frequencies.

    A stretch too short to tell gets the ratio of its run, a run without any the mean of all. What
    the fish itself makes of a commanded frequency is divided out: its model multiplies by it.

    Args:
        dataset: measured runs.
        fish: whose model reads the commands.
    """
    beats = beats_of(dataset)
    if not beats:
        return dataset
    own = own_ratio(fish)
    ratios = by_run(beats)
    mean = float(np.mean([ratio for ratio, _ in ratios.values()]))
    known = {(beat.run, beat.row): beat.measured for beat in beats}
    runs = []
    for run in dataset.runs:
        values = run.commands.values.copy()
        values[:, _FREQUENCY] *= ratios.get(run.id, (mean, 0.0))[0]
        for row in range(len(values)):
            values[row, _FREQUENCY] = known.get((run.id, row), values[row, _FREQUENCY])
        values[:, _FREQUENCY] /= own
        runs.append(replace(run, commands=CommandSteps(run.commands.times_s, values)))
    note = f"tail frequencies are measured ones, {mean:.3f} times the commanded ones in the mean"
    if own != 1.0:
        note += f"; commands are divided by {own:.3f}, which {fish.name} multiplies them by"
    return replace(dataset, runs=tuple(runs), notes=(*dataset.notes, note))


def own_ratio(fish: FishParams) -> float:
    """Recorded over commanded frequency by the fish's own tail and its recorder's clock."""
    # Recorded time is true time over the clocks' scales.
    names = ("frequency_scale", "clock_scale", "clock_skew")
    return math.prod(float(fish.effects.get(name, {}).get("scale", 1.0)) for name in names)
