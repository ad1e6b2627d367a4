"""An empirical model of what no known cause explains, judged on runs that did not choose it.

Wrenches of no particular origin are added, whichever the data ask for most beside those that are
there, as long as chance does not ask as loudly. Their sizes are estimated together while the
coefficients follow; then everything else is fitted again with the wrench in place, disturbance
included, and what is still asked for is added. The result says how large what is missing is and
what it goes with. It does not say what it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.filtering import Filtered
from fish_env.identification.generic_forces import (
    BoundForces,
    GenericForces,
    generic_forces,
    probes,
)
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem, series_of
from fish_env.inference.adequacy import NOTHING, generic_signals
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.free import spread_of
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.gain import by_window
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector
from fish_env.inference.tails import chi2_log_tail

Columns = IntArray
RESTING = 0.3
"""Standard errors by which sizes may still move at the end."""


@dataclass(frozen=True)
class Term:
    """One wrench: coefficient times function over its scale.

    Attributes:
        function: what it depends on, see ``generic_forces.regressors``.
        direction: which force or moment of the hull.
        scale: root mean square of the function over the fitted runs, in SI units (angles in rad,
            frequencies in Hz).
        coefficient: N or N m, signed.
        error: its standard error, widened for coloured residuals.
    """

    function: str
    direction: str
    scale: float
    coefficient: float
    error: float


@dataclass(frozen=True)
class Judged:
    """One-step predictions of runs that did not choose the terms.

    Attributes:
        runs: their ids.
        gain: what the log likelihood gains by the terms and by the smaller disturbance they leave.
        gain_ci95: its interval over windows of three seconds.
    """

    runs: tuple[str, ...]
    gain: float
    gain_ci95: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ResidualModel:
    """A sum of wrenches.

    Attributes:
        terms: in the order in which they were added.
        beside: effects of the catalogue that are in the model too.
        noise: noise model without and with them.
        judged: how they do on other runs; None without any.
        fit: everything else fitted with them in place.
    """

    terms: tuple[Term, ...]
    beside: tuple[str, ...]
    noise: tuple[NoiseModel, NoiseModel]
    judged: Judged | None
    fit: Fit

    @property
    def held_out_gain(self) -> float | None:
        """Log likelihood that the final runs gain; None without such runs."""
        return None if self.judged is None else self.judged.gain


@dataclass(frozen=True, eq=False)
class _State:
    """Wrenches so far.

    Attributes:
        fit: everything else fitted with them in place.
        columns: which they are (k,).
        sizes: N or N m (k,).
        errors: of the sizes (k,).
    """

    fit: Fit
    columns: Columns
    sizes: FloatArray
    errors: FloatArray


def residual_model(
    explanation: Fit, threshold: float, final: Problem | None, rounds: int | None = None
) -> ResidualModel | None:
    """What an explanation leaves, as a sum of simple wrenches.

    Args:
        explanation: the best one there is.
        threshold: log p-value of a wrench that chance passes rarely enough.
        final: runs that chose nothing.
        rounds: most rounds of choosing and fitting; default: fewer where a round takes long.

    Returns:
        None where the data ask for no wrench beyond chance, or where they are not explained better
        with those that they ask for: then no sum of simple functions is what is missing.
    """
    series = series_of(explanation)
    like = forces = generic_forces(series.runs, explanation.filtered, series.channels)
    state = _State(explanation, np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    differing = spread_of(explanation.problem, explanation.noise).any()
    beside = bool(explanation.effects) or differing
    most = CHECKS.residual_rounds_beside if beside else CHECKS.residual_rounds
    for _ in range(most if rounds is None else rounds):
        chosen = _enlarged(state, forces, threshold)
        if not len(chosen.columns):
            return None
        rests = len(chosen.columns) == len(state.columns) and bool(
            np.all(np.abs(chosen.sizes - state.sizes) < RESTING * chosen.errors)
        )
        if rests:
            state = chosen
            break
        again = _refitted(chosen, forces)
        if again is None:
            break
        state = replace(chosen, fit=again)
        forces = like.along(series_of(again).runs, again.filtered)
    if not len(state.columns):
        return None
    terms = tuple(
        Term(*like.words(c), float(like.scale[c // 6]), float(a), float(e))
        for c, a, e in zip(state.columns, state.sizes, state.errors, strict=True)
    )
    judged = None if final is None else _judged(explanation, state, like, final)
    return ResidualModel(
        terms, explanation.effects, (explanation.noise, state.fit.noise), judged, state.fit
    )


def _enlarged(state: _State, forces: GenericForces, threshold: float) -> _State:
    """With the wrenches that are still asked for, without those no longer needed."""
    own, present = state.fit, list(state.columns)
    projector = Projector(own)
    bound = BoundForces(own, forces)
    asked = sorted(generic_signals(bound, projector), key=lambda signal: signal[1].log_p)
    others = [column for column, _ in asked[: CHECKS.residual_pool] if column not in present]
    pool = np.array([*present, *others], np.int64)
    before = np.r_[state.sizes, np.zeros(len(others))] / probes(pool)
    change = own.linearised.whitened(bound.changes(pool).T).T
    # A wrench that shows nothing, or makes the simulation diverge, would spoil the test of all.
    each = projector.signals([(NOTHING, 0, [i]) for i in range(len(pool))], change.T)
    seen = np.array([signal is not None for signal in each], bool)
    kept = int(seen[: len(present)].sum())
    pool, change, before = pool[seen], change[:, seen], before[seen]
    chooser = _Chooser(own, projector, change, before, threshold)
    chosen = chooser.chosen(list(range(kept)))
    sizes, errors = chooser.sizes(chosen)
    unit = probes(pool[chosen])
    return replace(state, columns=pool[chosen], sizes=unit * sizes, errors=unit * errors)


class _Chooser:
    """Chooses among wrenches by what they change in the residuals.

    Args:
        own: fit with some of them in place already.
        projector: of that fit.
        change: (D, N) change of its residuals.
        before: (N,) sizes in place.
        threshold: log p-value that each must pass beside all others.
    """

    def __init__(
        self, own: Fit, projector: Projector, change: FloatArray, before: FloatArray,
        threshold: float,
    ) -> None:  # fmt: skip
        self.residuals, self.projector = own.linearised.residuals, projector
        self.before, self.threshold = before, threshold
        self.all = projector.signal(NOTHING, 0, change) if change.size else None

    def chosen(self, present: list[int]) -> list[int]:
        """Those worth having: the present ones and more, in the order they were added."""
        if self.all is None:
            return []
        chosen = present
        while len(chosen) < CHECKS.most_residual_terms:
            log_p = {i: self._log_p([*chosen, i])[-1] for i in self._apart(chosen)}
            best = min(log_p, key=lambda i: log_p[i], default=None)
            if best is None or log_p[best] > self.threshold:
                break
            chosen = [*chosen, best]
        while chosen:
            every = self._log_p(chosen)
            weakest = int(np.argmax(every))
            if every[weakest] < self.threshold:
                break
            chosen = [*chosen[:weakest], *chosen[weakest + 1 :]]
        return chosen

    def sizes(self, chosen: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Sizes of some wrenches together, and their standard errors (k,) each."""
        if self.all is None or not chosen:
            return np.zeros(0), np.zeros(0)
        own = list(chosen)
        inverse = np.linalg.inv(self.all.projected[np.ix_(own, own)])
        more = inverse @ self.all.score[own]
        left = self.all.left[:, own]
        inflation = self.projector.variance_inflation(left, self.residuals + left @ more)
        return self.before[own] + more, np.sqrt(inflation * np.diag(inverse))

    def _log_p(self, chosen: Sequence[int]) -> FloatArray:
        """Logarithm of the p-value of each beside all others (k,)."""
        sizes, errors = self.sizes(chosen)
        return np.asarray(chi2_log_tail((sizes / errors) ** 2, np.ones(len(sizes))))

    def _apart(self, chosen: Sequence[int]) -> list[int]:
        """Wrenches of which the chosen ones leave something."""
        assert self.all is not None
        whole, own = self.all.projected, list(chosen)
        shared = whole[:, own]
        swallowed = shared * np.linalg.solve(whole[np.ix_(own, own)], shared.T).T
        left = 1.0 - swallowed.sum(axis=1) / np.diag(whole)
        least = CHECKS.least_residual_share
        return [i for i in range(len(whole)) if i not in own and left[i] > least]


def _refitted(state: _State, forces: GenericForces) -> Fit | None:
    """All else fitted with the wrenches in place; None where that is no better.

    The objective is comparable, as it counts the disturbance that each needs.
    """
    own = state.fit
    series = series_of(own)
    problem = series.with_runs(_carrying(series.runs, forces, state))
    try:
        again = fit(problem, own.effects, own.point, own.noise, own.released, rounds=2)
    except np.linalg.LinAlgError:
        return None
    return again if again.objective < own.objective else None


def _carrying(runs: Sequence[RunData], forces: GenericForces, state: _State) -> list[RunData]:
    """The runs with the wrenches as known ones, from the motion that `forces` saw."""
    result = []
    for run, basis in zip(runs, forces.bases, strict=True):
        wrench = np.zeros((len(basis), 6))
        for column, size in zip(state.columns, state.sizes, strict=True):
            wrench[:, column % 6] += size * basis[:, column // 6]
        result.append(replace(run, wrench=wrench))
    return result


def _judged(explanation: Fit, state: _State, like: GenericForces, runs: Problem) -> Judged:
    """One-step predictions of other runs without and with the wrenches.

    The wrench follows from the motion, and the filtered motion from the wrench: filtered twice,
    both agree.
    """
    assert isinstance(runs, SeriesProblem)
    final, before = evaluated(runs, explanation.point, explanation.noise)
    own, after = state.fit, before
    for _ in range(2):
        forces = like.along(final.runs, after)
        carrying = final.with_runs(_carrying(final.runs, forces, state))
        _, after = evaluated(carrying, own.point, own.noise)
    scores = [
        np.concatenate(by_window(final, log_likelihoods(final, filtered), np.nansum))
        for filtered in (before, after)
    ]
    gains = scores[1] - scores[0]
    gain, spread = float(gains.sum()), 1.96 * float(np.std(gains) * np.sqrt(len(gains)))
    return Judged(tuple(r.id for r in final.runs), gain, (gain - spread, gain + spread))


def log_likelihoods(problem: SeriesProblem, filtered: Sequence[Filtered]) -> FloatArray:
    """Log likelihood of each value given all before (D,), NaN where nothing was measured.

    Without the constant.

    Args:
        problem: the runs.
        filtered: the same runs filtered.
    """
    scale = np.concatenate([np.einsum("tii->ti", own.whitening).ravel() for own in filtered])
    residuals = np.concatenate([own.residuals for own in filtered])
    values = np.log(np.where(scale > 0.0, scale, 1.0)) - 0.5 * residuals**2
    return np.where(problem.measured, values, np.nan)
