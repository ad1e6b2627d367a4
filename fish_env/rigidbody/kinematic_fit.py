"""Fits and tests of the kinematic relations between measured channels.

Each relation of :mod:`fish_env.rigidbody.kinematics` is fitted with biases, scale, delay and
mounting free, by generalised least squares under white noise of both sides. The noise of real
sensors is coloured, so errors and p-values do not rest on that: the runs are cut into windows, and
the scores of whole windows are given random signs (wild cluster bootstrap). The level holds for
the largest of all settings of all relations together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import solveh_banded

from fish_env.arrays import FloatArray, IntArray
from fish_env.rigidbody.kinematics import Increments, Prepared, Relation
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun, Recording

WINDOWS_S = (3.0, 6.0, 12.0)
"""Lengths of window that are tried until the scores of neighbours are independent."""
ROUNDS = 6
POWER_80 = 0.8416
"""Quantile of the normal distribution at 0.8."""


@dataclass(frozen=True)
class Estimate:
    """One setting of one relation.

    Attributes:
        name: "attitude.bias_r" and the like.
        unit: SI.
        words: what it says about the sensors.
        value: estimate; zero is consistent.
        error: standard error.
        p: of a value as large by chance, for the largest of all settings together.
        detectable: smallest value found with power 0.8.
    """

    name: str
    unit: str
    words: str
    value: float
    error: float
    p: float
    detectable: float

    @property
    def found(self) -> bool:
        """Whether the channels contradict each other in this."""
        return self.p < RECORDINGS.consistency_level


@dataclass(frozen=True)
class Tested:
    """One relation, fitted.

    Attributes:
        name: "attitude" or "position".
        channels: that it relates.
        level: roll and pitch were taken to be zero.
        windows: number of them; too few to test below `fewest_consistency_windows`.
        window_s: their length.
        estimates: of its settings; empty if it was not tested.
        left: root mean square of the whitened increments left over; 1 is noise.
    """

    name: str
    channels: tuple[str, ...]
    level: bool
    windows: int
    window_s: float
    estimates: tuple[Estimate, ...]
    left: float

    def estimate(self, name: str) -> Estimate | None:
        """A setting by its short name, if it is among those tested."""
        full = f"{self.name}.{name}"
        return next((e for e in self.estimates if e.name == full), None)


@dataclass(frozen=True, eq=False)
class Linear:
    """A run's increments at some settings, and how they change with them, (n, rows, k)."""

    increments: Increments
    slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Scores:
    """Least squares, one entry a window: curvature (W, k, k), scores (W, k), and their runs."""

    curvature: FloatArray
    score: FloatArray
    run: IntArray
    left: float


def fit_relation(
    recording: Recording,
    relation: Relation,
    noise: Mapping[str, float],
    rng: np.random.Generator,
    sharing: int = 1,
    draws: int = RECORDINGS.consistency_draws,
) -> Tested:
    """Fit a relation and test its settings.

    Args:
        recording: measured runs.
        relation: one that its channels allow.
        noise: standard deviation of the white noise of each channel.
        rng: for the random signs.
        sharing: how many relations share the level.
        draws: number of draws that p-values come from.
    """
    about = relation.name, (*relation.outputs, *relation.inputs), relation.level
    fitted = _fit(recording, relation, noise)
    if fitted is None:
        return Tested(*about, 0, WINDOWS_S[0], (), float("nan"))
    values, scores, length = fitted
    errors, largest = _resampled(scores, rng, draws)
    errors = np.maximum(errors, _unresolved(recording, relation, noise, values))
    critical = float(np.quantile(largest, 1.0 - RECORDINGS.consistency_level / sharing))
    estimates = []
    for setting, value, error in zip(relation.settings, values, errors, strict=True):
        beyond = 1 + int(np.sum(largest >= abs(value) / error))
        p = min(1.0, sharing * beyond / (len(largest) + 1))
        name, seen = f"{relation.name}.{setting.name}", (critical + POWER_80) * float(error)
        estimates.append(
            Estimate(name, setting.unit, setting.words, float(value), float(error), p, seen)
        )
    return Tested(*about, len(scores.score), length, tuple(estimates), scores.left)


def _fit(
    recording: Recording, relation: Relation, noise: Mapping[str, float]
) -> tuple[FloatArray, Scores, float] | None:
    """Settings, scores there, and the length of the windows; None with too few windows."""
    prepared = _prepared(recording.runs, relation)
    values = _settled(prepared, relation, noise)
    if values is None:
        return None
    chosen = WINDOWS_S[0]
    linear = [_linearised(run, relation, values) for run in prepared]
    for length in WINDOWS_S:
        longer = _scores(linear, relation, values, noise, length)
        if length > chosen and len(longer.score) < 2 * RECORDINGS.fewest_consistency_windows:
            break
        scores, chosen = longer, length
        if not _neighbours_correlated(scores):
            break
    return values, scores, chosen


def _prepared(runs: Sequence[RecordedRun], relation: Relation) -> list[Prepared]:
    """Runs read for a relation, of those with samples to compare."""
    return [run for run in map(relation.prepared, runs) if run is not None]


def _settled(
    prepared: Sequence[Prepared], relation: Relation, noise: Mapping[str, float]
) -> FloatArray | None:
    """Settings by Gauss-Newton; None with too few windows."""
    values, small = np.zeros(len(relation.settings)), np.array([s.size for s in relation.settings])
    for _ in range(ROUNDS):
        linear = [_linearised(run, relation, values) for run in prepared]
        scores = _scores(linear, relation, values, noise, WINDOWS_S[0])
        if len(scores.score) < RECORDINGS.fewest_consistency_windows:
            return None
        step = np.linalg.lstsq(scores.curvature.sum(0), scores.score.sum(0), rcond=None)[0]
        values = values + step
        if np.all(np.abs(step) < 0.01 * small):
            break
    return values


def _unresolved(
    recording: Recording, relation: Relation, noise: Mapping[str, float], values: FloatArray
) -> FloatArray:
    """What every other sample of the inputs would change in the settings.

    A spline knows nothing of motion that is quicker than the samples. Where that matters, it
    matters more on half of them.
    """
    thinned = [_thinned(run, relation.inputs) for run in recording.runs]
    coarse = _settled(_prepared(thinned, relation), relation, noise)
    return np.zeros(len(values)) if coarse is None else np.abs(coarse - values)


def _thinned(run: RecordedRun, names: Sequence[str]) -> RecordedRun:
    """A run in which every other sample of some channels is missing."""
    even = np.arange(len(run.time_s)) % 2 == 0
    thin = {name: np.where(even, run.channels[name], np.nan) for name in names}
    return replace(run, channels={**run.channels, **thin})


def _linearised(run: Prepared, relation: Relation, values: FloatArray) -> Linear:
    """Increments of a run, and their slopes by central differences."""
    centre = relation.increments(run, values)
    slopes = np.empty((*centre.left.shape, len(values)))
    for i, setting in enumerate(relation.settings):
        step = setting.size * np.eye(len(values))[i]
        up, down = (relation.left(run, values + s) for s in (step, -step))
        slopes[:, :, i] = (up - down) / (2.0 * setting.size)
    return Linear(centre, slopes)


def _scores(
    linear: Sequence[Linear], relation: Relation, values: FloatArray,
    noise: Mapping[str, float], length: float,
) -> Scores:  # fmt: skip
    """Curvature and scores of every window that is at least half measured."""
    curvature, score, runs, squares, count = [], [], [], 0.0, 0
    for number, run in enumerate(linear):
        time, span = run.increments.middle_s, run.increments.span_s
        window = np.floor((time - time[0]) / length).astype(int)
        for chosen in (np.flatnonzero(window == w) for w in np.unique(window)):
            if span[chosen].sum() < 0.5 * length:
                continue
            a, g, square = _window(run, relation, values, noise, chosen)
            curvature.append(a)
            score.append(g)
            runs.append(number)
            squares, count = squares + square, count + chosen.size * len(relation.outputs)
    k = len(values)
    left = float(np.sqrt(squares / max(count, 1)))
    return Scores(
        np.reshape(curvature, (-1, k, k)), np.reshape(score, (-1, k)), np.array(runs), left
    )


def _window(
    run: Linear, relation: Relation, values: FloatArray, noise: Mapping[str, float],
    chosen: npt.NDArray[np.intp],
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Curvature, score and squared residuals of one window."""
    names = [setting.name for setting in relation.settings]
    scale = names.index("scale") if "scale" in names else -1
    stretch = 1.0 + values[scale] if scale >= 0 else 1.0
    a, g, squares = np.zeros((len(names),) * 2), np.zeros(len(names)), 0.0
    for row, output in enumerate(relation.outputs):
        carried = _carried_noise(run.increments, row, relation, noise, chosen)
        bands = _output_noise(run.increments, noise[output], chosen) + stretch**2 * carried
        left, slopes = run.increments.left[chosen, row], run.slopes[chosen, row]
        solved = solveh_banded(bands, np.column_stack([left, slopes]), lower=True)
        a += slopes.T @ solved[:, 1:]
        g -= slopes.T @ solved[:, 0]
        squares += float(left @ solved[:, 0])
        if scale >= 0:
            # What is integrated carries noise, which would pull the scale down.
            g[scale] += stretch * _trace(bands, carried)
    return a, g, squares


def _output_noise(increments: Increments, sd: float, chosen: npt.NDArray[np.intp]) -> FloatArray:
    """Covariance of differences of white noise, as bands (2, n)."""
    joined = increments.joined[chosen[1:]] & (np.diff(chosen) == 1)
    return sd**2 * np.vstack([np.full(chosen.size, 2.0), np.append(-1.0 * joined, 0.0)])


def _carried_noise(
    increments: Increments, row: int, relation: Relation, noise: Mapping[str, float],
    chosen: npt.NDArray[np.intp],
) -> FloatArray:  # fmt: skip
    """Covariance of what the inputs' noise leaves in the integrals, as bands (2, n)."""
    variance = np.array([noise[name] ** 2 for name in relation.inputs])
    span = increments.span_s[chosen]
    density = increments.gain[chosen, row] ** 2 @ variance * increments.input_step_s * span
    # Neighbours share the sample between them, as far as the inputs are no denser.
    shared = np.minimum(1.0, increments.input_step_s / span)
    joined = increments.joined[chosen[1:]] & (np.diff(chosen) == 1)
    beside = 0.25 * np.sqrt(density[1:] * density[:-1]) * shared[1:] * joined
    return np.vstack([density * (1.0 - 0.5 * shared), np.append(beside, 0.0)])


def _trace(whole: FloatArray, part: FloatArray) -> float:
    """tr(whole^-1 part) of two matrices given as bands, exact where both are Toeplitz."""
    n = whole.shape[1]
    cosine = 2.0 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    a, b = whole[0].mean(), whole[1].sum() / max(n - 1, 1)
    c, d = part[0].mean(), part[1].sum() / max(n - 1, 1)
    return float(np.sum((c + d * cosine) / (a + b * cosine)))


def _neighbours_correlated(scores: Scores) -> bool:
    """Whether scores of windows that follow each other go together."""
    unit = scores.score / np.sqrt(np.mean(scores.score**2, axis=0) + 1e-300)
    follows = scores.run[1:] == scores.run[:-1]
    products = (unit[1:] * unit[:-1])[follows]
    if not products.size:
        return False
    mean = products.mean(axis=0)
    chance = 2.5 / np.sqrt(follows.sum())
    return bool(np.any(mean > chance))


def _resampled(
    scores: Scores, rng: np.random.Generator, draws: int
) -> tuple[FloatArray, FloatArray]:
    """Standard errors of the settings, and draws of the largest studentised error of all.

    Errors are those of leaving one window out at a time, which few windows make large rather than
    small. The draws repeat this with the scores under random signs.
    """
    total = np.linalg.pinv(scores.curvature.sum(0), hermitian=True)
    # Influence of each window, as if it had not taken part in the fit.
    k = len(total)
    hat = np.eye(k) - scores.curvature @ total
    free = np.linalg.solve(hat, scores.score[:, :, None])[:, :, 0]
    influence = free @ total
    count = len(influence)
    errors = np.sqrt(np.sum(influence**2, axis=0) * (count - 1) / count)
    largest = np.empty(draws)
    for first in range(0, draws, 500):
        signs = rng.choice([-1.0, 1.0], (min(500, draws - first), count))
        moved = signs @ influence
        # Scores about the moved estimate.
        drawn = signs[:, :, None] * free - np.einsum("wij,dj->dwi", scores.curvature, moved)
        spread = np.einsum("dwi,ij->dwj", drawn, total)
        drawn_errors = np.sqrt(np.sum(spread**2, axis=1))
        largest[first : first + len(signs)] = np.max(np.abs(moved) / drawn_errors, axis=1)
    return errors, largest
