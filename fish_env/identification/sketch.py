"""A quick look at what a fit with one more effect would reach, before the full fit is paid for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fish_env.identification.estimator import Fit, gauss_newton, objective_at
from fish_env.identification.free import Free, objective
from fish_env.identification.phases import settle_phases
from fish_env.identification.problem import Point, Problem

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
        objective: -2 log likelihood + prior there, on the runs of the sketch.
    """

    effects: tuple[str, ...]
    released: tuple[str, ...]
    point: Point
    objective: float


class Sketcher:
    """Sketches on a few runs of a fit.

    Args:
        fit: what is fitted already; its noise model is used.
        runs: how many of its runs to use, spread over all of them.
    """

    def __init__(self, fit: Fit, runs: int = 2) -> None:
        self.fit = fit
        problem = fit.problem
        if not problem.has_corners(fit.point.effects):
            problem = problem.with_plain_steps()  # good enough to see who leads, and much quicker
        self.few: Problem = problem.subset(runs)
        self.one: Problem = problem.subset(1)

    @cached_property
    def base(self) -> float:
        """Objective of the fit itself on these runs."""
        own = Free(self.few, self.fit.effects, self.fit.released)
        return objective(self.few, own, own.pack(self.fit.point), self.fit.noise)[0]

    def sketch(
        self, effects: Sequence[str], released: Sequence[str], starts: Sequence[Point]
    ) -> Sketch:
        """A few Gauss-Newton steps from the best of some starts, which a single run chooses.

        Args:
            effects: names of effects that are free.
            released: baseline coefficients whose prior is lifted.
            starts: values of all effects' parameters.

        Raises:
            LinAlgError: the simulation diverges from every start.
        """
        free = Free(self.few, effects, released)
        noise = self.fit.noise
        values = [objective_at(self.one, effects, point, noise, released) for point in starts]
        best = int(np.argmin(np.where(np.isfinite(values), values, np.inf)))
        vector = free.clip(free.pack(starts[best]))
        few = settle_phases(self.few, free.unpack(vector), noise)
        vector, value, _ = gauss_newton(few, free, vector, noise, STEPS, TOLERANCE)
        return Sketch(tuple(effects), tuple(released), free.unpack(vector), value)
