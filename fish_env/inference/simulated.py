"""Causes beside something unknown, in simulation: which act there as they do one sample ahead.

One sample ahead a cause may stand in for the spectrum of what is unknown. In simulation without
feedback such an imitation is worth little or the opposite, or many times what it is one sample
ahead. A cause that acts is worth the same in both. Two estimates of one size that differ for
certain reject the model: Hausman (1978), "Specification tests in econometrics", Econometrica 46,
1251.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import CauseId
from fish_env.inference.over_runs import over_runs
from fish_env.inference.partial import rejected_in_turn
from fish_env.inference.policy import POLICY
from fish_env.inference.progress import Report, silent
from fish_env.inference.stand_ins import StandIns


@dataclass(frozen=True)
class SimulatedSize:
    """The size of a cause in simulation, as a multiple of its estimate.

    Attributes:
        size: 1 where simulation asks for the estimate, 0 where it asks for no such cause.
        low: above this is the size, with 95 % confidence over runs.
        high: below this.
    """

    size: float
    low: float
    high: float

    @property
    def contradiction(self) -> float:
        """How far the interval is from all sizes of a cause that acts; negative inside."""
        least, most = POLICY.least_simulated_size, POLICY.most_simulated_size
        return max(-self.low, least - self.high, self.low - most)

    @property
    def words(self) -> str:
        """The size with its interval."""
        return f"{self.size:.2g} times its estimate ({self.low:.2g} to {self.high:.2g})"


def sustained(found: Explanation, report: Report = silent) -> Explanation | None:
    """The explanation with those of its causes whose size simulation confirms.

    The size that simulation asks for is surely positive, and not surely another one than the
    estimate: two tests of one side each, at 5 %. A drive that was measured to be out of step may
    take longer to show than such a simulation lasts.

    Args:
        found: causes that act beside something unknown.
        report: told what is dropped and why.

    Returns:
        The causes that are left with their fit; None where none is.
    """

    def rejected(found: Explanation, others: Sequence[CauseId]) -> tuple[CauseId, str] | None:
        sizes = simulated_sizes(found, others)
        if sizes is None:
            return None
        worst = max(others, key=lambda name: sizes[name].contradiction)
        if sizes[worst].contradiction < 0.0:
            return None
        return worst, f"simulation asks for {sizes[worst].words}"

    return rejected_in_turn(found, rejected, report)


def simulated_sizes(
    found: Explanation, names: Sequence[CauseId]
) -> dict[CauseId, SimulatedSize] | None:
    """What size of each cause simulation asks for; None where a simulation with all diverges.

    The regression of the residuals of a simulation without the cause on what the cause changes, all
    other parameters following it in the linear model. Runs are weighted by the residuals with all
    causes: one that is badly predicted says little about any cause.

    Args:
        found: the causes with their fit.
        names: those asked for.
    """
    left, changed = _regressed(found, names)
    if not (np.isfinite(left).all() and np.isfinite(changed).all()):
        return None
    return {name: _size(a, b) for name, a, b in zip(names, left, changed, strict=True)}


def _size(left: FloatArray, changed: FloatArray) -> SimulatedSize:
    """A ratio of sums over runs, from its terms (R,); of fewer than three runs without interval."""
    if not changed.sum() > 0.0:
        return SimulatedSize(0.0, 0.0, 0.0)

    def size(runs: IntArray) -> FloatArray:
        return np.array([left[runs].sum() / max(changed[runs].sum(), np.finfo(float).tiny)])

    own = float(size(np.arange(len(left)))[0])
    interval = over_runs(size, len(left), 1.0 - 2.0 * POLICY.interval_error)
    return SimulatedSize(own, *(interval[0] if interval else (own, own)))


def _regressed(found: Explanation, names: Sequence[CauseId]) -> tuple[FloatArray, FloatArray]:
    """Products of the residuals without each cause and what it changes, and squares of the latter.

    Each (causes, R), in units of a run's sum of squared residuals with all causes.

    Args:
        found: the causes with their fit.
        names: those to leave out, each alone.
    """
    own = found.fit
    settled, filtered = evaluated(own.problem, own.point, own.noise)
    windows, still, run_of_window = settled.without_feedback(filtered, own.noise)
    model = StandIns(found, 0.0)
    points = [own.point, *(model.left_out(name) for name in names)]
    z = np.column_stack([point.z for point in points])
    effects = {id: np.array([p.effects[id] for p in points]) for id in own.point.effects}
    residuals = windows.innovations(z, effects, own.noise, still)
    run_of, runs = run_of_window[windows.groups()[0]], own.problem.run_count
    changes = residuals[1:] - residuals[0]

    def by_run(products: FloatArray) -> FloatArray:
        return np.array([np.bincount(run_of, row, runs) for row in products])

    unit = np.maximum(by_run(residuals[:1] ** 2), np.finfo(float).tiny)
    return by_run(residuals[1:] * changes) / unit, by_run(changes**2) / unit
