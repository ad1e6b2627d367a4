"""How the beat of the tail departs from its command: with time, with offset, with its own speed.

Order tracking gives the beat of every few cycles, whatever forces act on the hull. A regression of
these ratios on what is known to slow a drive says where a fit may begin. From a drive that is out
of step no slope leads to the right size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import stdtr

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.diagnosis.inputs.clocks import strokes_of
from fish_env.diagnosis.inputs.orders import FREQUENCY, drive_terms, windows_of
from fish_env.diagnosis.inputs.ratios import peaks_of, ratio_near
from fish_env.diagnosis.policy import CHECKS
from fish_env.effects import catalogue
from fish_env.identification.tail_drive import RATE, SCALE
from fish_env.inference.hypotheses import EffectParameterId

SAID = {
    RATE: "more with each second of a run (`battery_sag`)",
    EffectParameterId("beat_load", "offset"): "for each radian of its offset (`beat_load`)",
    EffectParameterId("beat_load", "load"): "for each rad/s of its stroke (`beat_load`)",
    EffectParameterId("side_load", "beat"): "with any offset (`side_load`)",
}
"""Effect parameters by which the beat falls, in the order of the windows' terms, in words."""
TERMS = tuple(SAID)
SMALLEST = tuple(
    next(p.plausible[0] for p in catalogue()[term.effect].parameters if p.name == term.name)
    for term in TERMS
)
"""The least that the catalogue takes for plausible. Without any such effect the regression finds
less than a third of it."""
ROUNDS = 8
HELD_S = 0.5
"""For which a frequency that falls with time is taken as constant."""


@dataclass(frozen=True)
class DriveLaw:
    """The beat over the commanded frequency: common (1 - sum of each size times its term).

    Attributes:
        common: ratio at the start of a run, without offset and stroke; None where no beat is clear.
        sizes: effect parameter of :data:`TERMS` -> size, of those that show.
        p: largest p-value of these, times the number of terms that were tested (Bonferroni);
            1 where none shows.
    """

    common: float | None = None
    sizes: Mapping[EffectParameterId, float] = field(default_factory=dict)
    p: float = 1.0

    @property
    def words(self) -> str:
        """What the beat does, a clause; empty where it follows its command."""
        found = [f"by {100.0 * size:.2g} % {SAID[term]}" for term, size in self.sizes.items()]
        return f"the tail beats more slowly than commanded: {' and '.join(found)}" if found else ""

    def starts(self, common: float = 1.0) -> dict[EffectParameterId, float]:
        """Where fits begin: effect parameter -> value; nothing where no beat is clear.

        Args:
            common: ratio of all beats that was put right before the law was found.
        """
        if self.common is None:
            return {}
        return {SCALE: self.common * common, **self.sizes}

    def following(self, dataset: Dataset) -> Dataset:
        """The dataset as if it had been commanded to beat as time, offset and stroke let it.

        A frequency that falls with time is commanded anew every :data:`HELD_S`. Without a law the
        dataset is the same.
        """
        if not self.sizes:
            return dataset
        return replace(dataset, runs=tuple(self._following(run) for run in dataset.runs))

    def _following(self, run: Run) -> Run:
        begin, end = run.time_s[[0, -1]]
        times = run.commands.times_s
        if RATE in self.sizes:
            samples = np.searchsorted(run.time_s, np.arange(begin, end, HELD_S))
            times = np.union1d(times, run.time_s[samples])
        values = run.commands.at(times)
        middle = 0.5 * (times + np.append(times[1:], end))
        terms = drive_terms(np.maximum(middle - begin, 0.0), values)
        sizes = np.array([self.sizes.get(term, 0.0) for term in TERMS])
        left = np.prod(np.maximum(1.0 - sizes * terms, 0.0), axis=1)
        values[:, FREQUENCY] *= left * (self.common or 1.0)
        return replace(run, commands=CommandSteps(times, values))


def drive_law(dataset: Dataset) -> DriveLaw:
    """How the beat departs from its command in all runs.

    Args:
        dataset: measured runs, with what is grossly wrong put right.
    """
    strokes = strokes_of(dataset)
    whole = ratio_near(list(strokes.values()))
    if whole is None:
        return DriveLaw()
    rows, run_of = [], []
    for number, stroke in enumerate(strokes.values()):
        windows = windows_of([stroke], whole.value)
        every = [terms for own in windows for terms in own.terms]
        for terms, peak in zip(every, peaks_of(windows, whole.value)[1], strict=True):
            if np.isfinite(peak[0]):
                rows.append([*peak, *terms])
                run_of.append(number)
    if len(rows) < 2 * (len(TERMS) + 1):
        return DriveLaw(whole.value)
    ratio, weight, *terms = np.array(rows).T
    return _law(ratio, weight, np.array(terms).T, np.array(run_of))


def _law(ratio: FloatArray, weight: FloatArray, terms: FloatArray, run_of: IntArray) -> DriveLaw:
    """The law of windows' ratios (N,); terms that do not show are left out, the least first."""
    kept = [i for i in range(len(TERMS)) if np.ptp(terms[:, i]) > 1e-9]
    while True:
        columns = np.column_stack([np.ones(len(ratio)), terms[:, kept]])
        value, error, freedom = _regression(columns, ratio, weight, run_of)
        sizes = -value[1:] / value[0]
        p = 2.0 * stdtr(freedom, -np.abs(value[1:] / error[1:]))
        small = np.array([size < SMALLEST[i] for size, i in zip(sizes, kept, strict=True)], bool)
        doubtful = np.where(small, 1.0, p)
        if not kept or doubtful.max() < CHECKS.drive_law_level:
            found = {TERMS[i]: float(size) for i, size in zip(kept, sizes, strict=True)}
            largest = min(1.0, len(TERMS) * float(doubtful.max())) if kept else 1.0
            return DriveLaw(float(value[0]), found, largest)
        kept.pop(int(np.argmax(doubtful)))


def _regression(
    columns: FloatArray, ratio: FloatArray, weight: FloatArray, run_of: IntArray
) -> tuple[FloatArray, FloatArray, int]:
    """Weighted least squares without far windows, each run having a beat of its own.

    The own beats are random intercepts: a term that differs between runs only counts for no more
    than the runs' number, and one that changes within runs counts in full.

    Args:
        columns: (N, k).
        ratio: (N,).
        weight: (N,).
        run_of: (N,) run of each row, whose errors are taken to depend on each other.

    Returns:
        (k,) estimates, (k,) their standard errors, and the degrees of freedom of the latter.
        Sources: Fuller and Battese (1974), J. Econometrics 2, 67, for the intercepts; Liang and
        Zeger (1986), Biometrika 73, 13, with the factor R / (R - k), for the errors.
    """
    runs, own = np.unique(run_of, return_inverse=True)
    near: BoolArray = np.ones(len(ratio), bool)
    shrink = np.zeros(len(runs))
    for _ in range(ROUNDS):
        used = weight * near
        rows = _less_means(np.column_stack([columns, ratio]), used, own, shrink)
        inverse = np.linalg.pinv(rows[:, :-1].T @ (used[:, None] * rows[:, :-1]))
        value = inverse @ rows[:, :-1].T @ (used * rows[:, -1])
        left = ratio - columns @ value
        offset, shrink = _own_offsets(left, used, own)
        left -= offset[own]
        scale = 1.4826 * float(np.median(np.abs(left[near])))
        near = np.abs(left) < CHECKS.far_window_sd * max(scale, 1e-4)
    pulls = rows[:, :-1] * (used * (rows[:, -1] - rows[:, :-1] @ value))[:, None]
    sums = np.array([pulls[own == run].sum(axis=0) for run in range(len(runs))])
    freedom = max(len(runs) - columns.shape[1], 1)
    covariance = inverse @ sums.T @ sums @ inverse * len(runs) / freedom
    return value, np.sqrt(np.maximum(np.diag(covariance), 1e-30)), freedom


def _own_offsets(
    left: FloatArray, weight: FloatArray, own: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Best predictions (R,) of the runs' own offsets, and the share (R,) of means to take off.

    Their variance is that of DerSimonian and Laird (1986), Controlled Clinical Trials 7, 177. With
    one window in each run nothing tells it from the noise of a window, and all are zero.

    Args:
        left: (N,) residuals.
        weight: (N,).
        own: (N,) run of each.
    """
    whole = np.maximum(np.bincount(own, weight), 1e-300)
    mean = np.bincount(own, weight * left) / whole
    freedom = int(np.count_nonzero(weight)) - len(whole)
    if freedom < 1:
        return np.zeros(len(whole)), np.zeros(len(whole))
    noise = max(float(weight @ (left - mean[own]) ** 2) / freedom, 1e-300)
    total = whole.sum()
    apart = float(whole @ mean**2) / noise - (len(whole) - 1)
    between = max(apart * noise / max(total - float(whole @ whole) / total, 1e-300), 0.0)
    told = whole * between / (noise + whole * between)
    return told * mean, 1.0 - np.sqrt(1.0 - told)


def _less_means(
    rows: FloatArray, weight: FloatArray, own: IntArray, shrink: FloatArray
) -> FloatArray:
    """Rows (N, k) without a share (R,) of the weighted means of their runs."""
    whole = np.maximum(np.bincount(own, weight), 1e-300)
    means = np.array([np.bincount(own, weight * column) for column in rows.T]) / whole
    return np.asarray(rows - (shrink * means)[:, own].T)
