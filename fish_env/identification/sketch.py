"""A quick look at what a fit with one more effect would reach, before the full fit is paid for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from fish_env.identification.descent import descend
from fish_env.identification.estimator import Fit, quadratic
from fish_env.identification.free import Free, linearise, objective_of, objectives_with_gains
from fish_env.identification.phases import settle_phases
from fish_env.identification.problem import Point, Problem

FloatArray = npt.NDArray[np.float64]
STEPS = 5
TOLERANCE = 0.5
"""A sketch ends when no parameter moves by more of its standard deviation."""


@dataclass(frozen=True, eq=False)
class Sketch:
    """A point on the way to a fit.

    Attributes:
        effects: names of the effects that are free.
        released: baseline coefficients whose prior is lifted.
        point: values reached.
        objective: -2 log likelihood + prior there, on the runs of the sketch, but for a constant
            of the sketcher.
    """

    effects: tuple[str, ...]
    released: tuple[str, ...]
    point: Point
    objective: float


class Sketcher:
    """Sketches on a few runs of a fit, with the gains of its filter.

    The gains follow the noise and hardly the parameters; to filter anew at every point takes many
    times as long, and the fit that follows a sketch does.

    Args:
        fit: what is fitted already; its noise model is used.
        runs: how many of its runs to use, spread over all of them.
    """

    def __init__(self, fit: Fit, runs: int = 2) -> None:
        self.fit = fit
        self._usual = self._few(fit.problem, runs)
        self._long = self._few(fit.comparing, runs)
        self.filtered = [fit.filtered[i] for i in fit.problem.spread(runs)]

    def _few(self, problem: Problem, runs: int) -> Problem:
        if not problem.has_corners(self.fit.point.effects):
            problem = problem.with_plain_steps()  # good enough to see who leads, and much quicker
        return problem.subset(runs)

    def _problem_for(self, effects: Sequence[str]) -> Problem:
        """In long steps, but for effects that make the tail's rate jump: those would be blurred."""
        return self._usual if self.fit.problem.any_jumps(effects) else self._long

    @cached_property
    def base(self) -> float:
        """Objective of the fit itself on these runs."""
        few = self._problem_for(self.fit.effects)
        own = Free(few, self.fit.effects, self.fit.released)
        return self._objectives(few, own, [own.pack(self.fit.point)])[0]

    def sketch(
        self,
        effects: Sequence[str],
        released: Sequence[str],
        starts: Sequence[Point],
        hopeless: float = np.inf,
    ) -> Sketch:
        """A few Gauss-Newton steps from the best of some starts.

        Args:
            effects: names of effects that are free.
            released: baseline coefficients whose prior is lifted.
            starts: values of all effects' parameters.
            hopeless: stop early where the objective will not get below this.

        Raises:
            LinAlgError: the simulation diverges from every start.
        """
        few = self._problem_for(effects)
        free = Free(few, effects, released)
        vectors = [free.clip(free.pack(start)) for start in starts]
        few, vector = self._best(few, free, vectors)
        survey = partial(self._surveyed, few, free)
        vector, value, _ = descend(
            vector, survey, lambda _, known: known, free.within, STEPS, TOLERANCE, hopeless
        )
        return Sketch(tuple(effects), tuple(released), free.unpack(vector), value)

    def _best(
        self, few: Problem, free: Free, vectors: Sequence[FloatArray]
    ) -> tuple[Problem, FloatArray]:
        """The best of some vectors, and the problem with the tail phases that it asks for."""
        noise = self.fit.noise
        if all(run.phase_known for run in few.runs):
            values = self._objectives(few, free, vectors)
            return few, vectors[int(np.argmin(values))]
        settled = [settle_phases(few, free.unpack(v), noise) for v in vectors]
        pairs = zip(settled, vectors, strict=True)
        return min(pairs, key=lambda pair: self._objectives(pair[0], free, [pair[1]])[0])

    def _surveyed(
        self, problem: Problem, free: Free, vector: FloatArray
    ) -> tuple[float, tuple[FloatArray, FloatArray]]:
        """The objective with its half Hessian and gradient, which the next step asks for.

        A whole step is hardly ever refused, and the slopes' lanes hold the objective's.
        """
        lin = linearise(problem, free, vector, self.fit.noise, self.filtered)
        return objective_of(problem, free, vector, lin.residuals), quadratic(free, vector, lin)

    def _objectives(
        self, problem: Problem, free: Free, vectors: Sequence[FloatArray]
    ) -> list[float]:
        noise, filtered = self.fit.noise, self.filtered
        return objectives_with_gains(problem, free, vectors, noise, filtered)
