"""Outliers that show only beside a prediction of the motion, and are then missing samples.

After a jump of a command a spike of a rate may be motion, and beside a gap a sample has too few
neighbours to be interpolated. The one-step prediction of the nominal model knows commands and gaps.
What it misses changes slowly; an outlier stands alone among what is missed. A model that lacks
something misses jumps more often than sensors fail elsewhere: then nothing near jumps is left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import binom

from fish_env.arrays import BoolArray, FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.in_step import nominal_point
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem
from fish_env.rigidbody.outliers import Outliers
from fish_env.rigidbody.policy import RECORDINGS

BESIDE, AROUND = (-2, -1, 1, 2), (-4, -3, -2, -1, 1, 2, 3, 4)
"""Samples whose median says what is missed anyhow, and those that say how much that scatters."""
MAD_SD = 1.4826
"""Standard deviation of normal numbers over the median of their sizes."""


def without_model_outliers(
    problem: SeriesProblem, known: tuple[Outliers, ...]
) -> tuple[SeriesProblem, tuple[Outliers, ...]]:
    """The problem without further outliers, and all outliers that are known then.

    Args:
        problem: the runs, in step with their tails as far as that is known.
        known: outliers found by interpolation, which are missing samples already.
    """
    noise = replace(problem.default_noise(), phase_sd=0.0)
    sizes: list[list[float]] = [[] for _ in problem.channels]
    flagged = [np.zeros(run.measured.shape, bool) for run in problem.runs]
    near = [_near_jumps(run) for run in problem.runs]
    shares = _calm_shares(problem, known, near)
    point = nominal_point(problem)
    for _ in range(IDENTIFICATION.outlier_rounds):
        settled = problem.settled(point, noise)
        try:
            filtered = settled.filtered(point, noise, keep_slopes=True)
        except np.linalg.LinAlgError:
            break
        masks = [_missed(run, one) for run, one in zip(problem.runs, filtered, strict=True)]
        found = [np.zeros(raw.shape, bool) for raw in masks]
        for channel in range(len(problem.channels)):
            own = _of_channel([raw[:, channel] for raw in masks], near, shares[channel])
            for mask, (mine, size) in zip(found, own, strict=True):
                mask[:, channel] = mine
                sizes[channel] += size
        if not any(mask.any() for mask in found):
            break
        flagged = [a | b for a, b in zip(flagged, found, strict=True)]
        runs = [_without(run, mask) for run, mask in zip(problem.runs, found, strict=True)]
        problem = problem.with_runs(runs)
    return problem, _together(problem, known, flagged, sizes)


def _missed(run: RunData, filtered: Filtered) -> FloatArray:
    """(T, C) measured less predicted (SI); NaN where missing, or before the filter has settled.

    At the start of a run it still finds out where the fish is and how it moves.
    """
    assert filtered.slopes is not None
    settled = run.clock > IDENTIFICATION.unjudged_start_s
    judged = np.isfinite(run.measured) & settled[:, None]
    return np.asarray(np.where(judged, filtered.slopes.raw, np.nan))


def _near_jumps(run: RunData) -> BoolArray:
    """(T,) whether a command jumped so shortly before a sample that a spike may be motion."""
    steps = int(np.ceil(RECORDINGS.jump_settles_samples))
    padded = np.r_[np.zeros(steps, bool), run.fresh]
    shifted = [padded[i : i + len(run.fresh)] for i in range(steps + 1)]
    return np.asarray(np.logical_or.reduce(shifted))


def _calm_shares(
    problem: SeriesProblem, known: tuple[Outliers, ...], near: list[BoolArray]
) -> list[float]:
    """Share of outliers by channel away from jumps; one sample at least."""
    calm = sum(int(np.sum(~one)) for one in near)
    counts = {one.channel: one.count for one in known}
    return [max(counts.get(name, 0), 1) / max(calm, 1) for name in problem.channels]


def _of_channel(
    missed: list[FloatArray], near: list[BoolArray], share: float
) -> list[tuple[BoolArray, list[float]]]:
    """Which samples of each run are outliers, and how far each is off."""
    away = [_alone(one) for one in missed]
    every = np.concatenate([np.abs(one[np.isfinite(one)]) for one in away])
    scale = MAD_SD * float(np.median(every)) if every.size else np.inf
    found = [_peaks(one, scale) for one in away]
    at_jumps = sum(int(np.sum(mask & one)) for mask, one in zip(found, near, strict=True))
    samples = sum(int(np.sum(one)) for one in near)
    level = IDENTIFICATION.outliers_at_jumps_level
    if at_jumps and binom.sf(at_jumps - 1, samples, share) < level:
        found = [mask & ~one for mask, one in zip(found, near, strict=True)]
    return [(mask, np.abs(one[mask]).tolist()) for mask, one in zip(found, away, strict=True)]


def _shifted(values: FloatArray, by: int) -> FloatArray:
    """Values (T,) of so many samples later; NaN beyond the ends."""
    moved = np.full(len(values), np.nan)
    if by > 0:
        moved[:-by] = values[by:]
    else:
        moved[-by:] = values[:by]
    return moved


def _median_of(values: FloatArray, samples: tuple[int, ...]) -> FloatArray:
    """(T,) median of the samples at these distances; NaN where fewer than two are measured."""
    rows = np.array([_shifted(values, by) for by in samples])
    enough = np.isfinite(rows).sum(axis=0) >= 2
    found = np.full(len(values), np.nan)
    found[enough] = np.nanmedian(rows[:, enough], axis=0)
    return found


def _alone(missed: FloatArray) -> FloatArray:
    """(T,) how far what is missed of each sample is from what is missed of those beside it."""
    return missed - np.nan_to_num(_median_of(missed, BESIDE))


def _peaks(away: FloatArray, scale: float) -> BoolArray:
    """Samples (T,) that stand alone, by a gate of the scatter of all and of those around."""
    sizes = np.abs(away)
    local = MAD_SD * np.nan_to_num(_median_of(sizes, AROUND))
    largest = np.nanmax([np.nan_to_num(_shifted(sizes, by)) for by in BESIDE], axis=0)
    gate = RECORDINGS.outlier_gate_sd * np.maximum(scale, local)
    return np.asarray((sizes > gate) & (sizes >= largest))


def _without(run: RunData, mask: BoolArray) -> RunData:
    measured = np.where(mask, np.nan, run.measured)
    return replace(run, measured=np.ascontiguousarray(measured))


def _together(
    problem: SeriesProblem,
    known: tuple[Outliers, ...],
    flagged: list[BoolArray],
    sizes: list[list[float]],
) -> tuple[Outliers, ...]:
    """Outliers of both kinds, by channel."""
    more = dict(zip(problem.channels, range(len(sizes)), strict=True))
    every = []
    for one in known:
        i = more.get(one.channel)
        if i is None or not sizes[i]:
            every.append(one)
            continue
        both = tuple(
            a | b[:, i] if len(a) == len(b) else a
            for a, b in zip(one.flagged, flagged, strict=True)
        )
        every.append(replace(one, flagged=both, sizes=np.r_[one.sizes, sizes[i]]))
    return tuple(every)
