"""Coarse fits: roughly what a fit with one more effect would reach, on a few runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import (
    Free,
    objective_of,
    objectives_with_gains,
    quadratic,
)
from fish_env.inference.estimate.gauss_newton import Quadratic, descend
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem

STEPS = 5
SILENT = 1e-6
"""Change of the objective below which a size of an effect does nothing."""
TOLERANCE = 0.5
"""A coarse fit ends when no parameter moves by more of its standard deviation."""


@dataclass(frozen=True, eq=False)
class CoarseFit:
    """A point on the way to a fit.

    Attributes:
        effects: names of the effects that are free.
        released: baseline coefficients whose prior is lifted.
        point: values reached.
        objective: -2 log likelihood + prior there, on the runs of the coarse fit, but for a
            constant.
    """

    effects: tuple[str, ...]
    released: tuple[Coefficient, ...]
    point: Point
    objective: float


def where_ended(fit: Fit) -> CoarseFit:
    """Where a fit ended, without what it takes memory for."""
    return CoarseFit(fit.effects, fit.released, fit.point, fit.objective)


class CoarseFitter:
    """Coarse fits on a few runs of a fit, with the gains of its filter.

    The gains follow the noise and hardly the parameters; to filter anew at every point takes many
    times as long, and the full fit does so.

    Args:
        fit: what is fitted already; its noise model is used.
        runs: how many of its runs to use, spread over all of them.
    """

    def __init__(self, fit: Fit, runs: int = POLICY.coarse_fit_runs) -> None:
        self.fit = fit
        self._usual, self._long = fit.problem.subset(runs), fit.comparing.subset(runs)
        few = fit.problem.spread(runs)
        self.filtered = [fit.filtered[i] for i in few]
        whole = fit.linearised.marginal
        self.marginal = None if whole is None else whole.some(few)

    def _problem_for(self, effects: Sequence[str]) -> Problem:
        """In long steps, but for further lags.

        A lag that the usual steps follow may diverge in long ones; those of the fit itself do not.
        """
        problem = self.fit.problem
        further = problem.freedoms([name for name in effects if name not in self.fit.effects])
        quick = any(freedom.least > -np.inf for freedom in further)
        return self._usual if quick else self._long

    @cached_property
    def base(self) -> float:
        """Objective of the fit itself on these runs."""
        few = self._problem_for(self.fit.effects)
        own = Free(few, self.fit.effects, self.fit.released)
        return self._objectives(few, own, [own.pack(self.fit.point)])[0]

    def coarse_fit(
        self,
        effects: Sequence[str],
        released: Sequence[Coefficient],
        starts: Sequence[Point],
        give_up_above: float = np.inf,
    ) -> CoarseFit:
        """A few Gauss-Newton steps from the best of some starts.

        Args:
            effects: names of effects that are free.
            released: baseline coefficients whose prior is lifted.
            starts: values of all effects' parameters.
            give_up_above: stop early where the objective will not get below this.

        Raises:
            LinAlgError: the simulation diverges from every start.
        """
        few = self._problem_for(effects)
        free = Free(few, effects, released)
        vectors = [free.bounds.clip(free.pack(start)) for start in starts]
        few, vector = self._best(few, free, vectors)
        slopes = Slopes(free, self.fit.noise)

        def exactly(at: FloatArray, _: Quadratic) -> Quadratic:
            return quadratic(free, at, slopes.exact(few, at, self.filtered, self.marginal))

        vector, value, _ = descend(
            vector, partial(self._surveyed, few, slopes), exactly, free.bounds.beside(vector),
            STEPS, TOLERANCE, give_up_above, quickly=lambda _, known: known,
        )  # fmt: skip
        return CoarseFit(tuple(effects), tuple(released), free.unpack(vector), value)

    def promising(
        self,
        effects: Sequence[str],
        released: Sequence[Coefficient],
        starts: Sequence[Point],
        most: int,
    ) -> list[Point]:
        """The likeliest starts, best first, as the runs' own starts have been settled so far.

        Args:
            effects: names of effects that are free.
            released: baseline coefficients whose prior is lifted.
            starts: values of all effects' parameters.
            most: how many to return.
        """
        few = self._problem_for(effects)
        free = Free(few, effects, released)
        vectors = [free.bounds.clip(free.pack(start)) for start in starts]
        return [free.unpack(v) for v in self._likeliest(few, free, vectors, most)]

    def _likeliest(
        self, few: Problem, free: Free, vectors: Sequence[FloatArray], most: int
    ) -> list[FloatArray]:
        """At most so many of some vectors, the likeliest first where there are more."""
        if len(vectors) <= most:
            return list(vectors)
        order = np.argsort(self._objectives(few, free, vectors), kind="stable")
        return [vectors[i] for i in order[:most].tolist()]

    def _best(
        self, few: Problem, free: Free, vectors: Sequence[FloatArray]
    ) -> tuple[Problem, FloatArray]:
        """The best of some vectors, and the problem settled there."""
        noise = self.fit.noise
        further = {f.id.effect for f in free.freedoms} - {*self.fit.effects}
        if few.starts_known(further):
            return few, self._best_acting(few, free, vectors)
        vectors = self._likeliest(few, free, vectors, POLICY.most_settled_starts)
        settled = [few.settled(free.unpack(v), noise, nearby=True) for v in vectors]
        pairs = zip(settled, vectors, strict=True)
        return min(pairs, key=lambda pair: self._objectives(pair[0], free, [pair[1]])[0])

    def _best_acting(self, few: Problem, free: Free, vectors: Sequence[FloatArray]) -> FloatArray:
        """The best of those vectors that change something, or of all where none does.

        Some effects do nothing up to a size: a limit that is never met. There they have no slope,
        and however bad a larger size may be, it leads on.
        """
        off = self._switched_off(few, free, vectors)
        values = np.array(self._objectives(few, free, [*vectors, *off.values()]))
        without = dict(zip(off, values[len(vectors) :], strict=True))
        own = values[: len(vectors)]
        beside = [without.get(vector[: free.count].tobytes(), np.nan) for vector in vectors]
        silent = [a == b or abs(a - b) < SILENT for a, b in zip(own, beside, strict=True)]
        return vectors[int(np.argmin(own if all(silent) else np.where(silent, np.inf, own)))]

    def _switched_off(
        self, few: Problem, free: Free, vectors: Sequence[FloatArray]
    ) -> dict[bytes, FloatArray]:
        """Coefficients of the vectors, as bytes -> the vector with further effects off.

        Empty where that is not a number, and where there is no choice.
        """
        names = {f.id.effect for f in free.freedoms} - {*self.fit.effects}
        neutral = few.neutral(names)
        if len(vectors) < 2 or not np.isfinite(list(neutral.values())).all():
            return {}
        points = [free.unpack(vector) for vector in vectors]
        return {
            point.z.tobytes(): free.pack(Point(point.z, {**point.effects, **neutral}))
            for point in points
        }

    def _surveyed(
        self, problem: Problem, slopes: Slopes, vector: FloatArray
    ) -> tuple[float, Quadratic]:
        """The objective with roughly its half Hessian and gradient, which the next step asks for.

        A whole step is hardly ever refused, and the slopes' lanes hold the objective's.
        """
        free = slopes.free
        lin = slopes.quick(problem, vector, self.filtered, self.marginal)
        return objective_of(problem, free, vector, lin.residuals), quadratic(free, vector, lin)

    def _objectives(
        self, problem: Problem, free: Free, vectors: Sequence[FloatArray]
    ) -> list[float]:
        noise, filtered = self.fit.noise, self.filtered
        return objectives_with_gains(problem, free, vectors, noise, filtered, self.marginal)
