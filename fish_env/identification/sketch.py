"""A quick look at what a fit with one more effect would reach, before the full fit is paid for.

The slopes by what is already fitted are kept from that fit, and only those by the new effect's
parameters are computed afresh. The steps are then a little off, the objective is not: each value
that a sketch reports is that of the full filter, so sketches are ranked as fits would be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.identification.estimator import Fit
from fish_env.identification.filtering import NoiseModel
from fish_env.identification.free import Free, objective, slopes_of
from fish_env.identification.information import information
from fish_env.identification.phases import settle_phases
from fish_env.identification.problem import Point, Problem
from fish_env.identification.products import inner

FloatArray = npt.NDArray[np.float64]
STEPS = 4
SETTLED = 1.0
"""A sketch ends when the objective (-2 log likelihood) falls by less."""


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
        kept: effects of the fit that every sketch has too; default: all.
    """

    def __init__(self, fit: Fit, runs: int = 3, kept: Sequence[str] | None = None) -> None:
        chosen = fit.problem.spread(runs)
        self.fit = fit
        self.few: Problem = fit.problem.with_runs([fit.problem.runs[i] for i in chosen])
        effects = fit.effects if kept is None else kept
        wanted = {*fit.problem.baseline.paths, *(f.path for f in fit.problem.freedoms(effects))}
        columns = [i for i, name in enumerate(fit.names) if name in wanted]
        rows = np.isin(fit.linearised.run_of, chosen)
        self.known = fit.linearised.slopes[rows][:, columns]

    def base(self) -> float:
        """Objective of the fit itself on these runs."""
        own = Free(self.few, self.fit.effects, self.fit.released)
        return objective(self.few, own, own.pack(self.fit.point), self.fit.noise)[0]

    def sketch(
        self, effects: Sequence[str], released: Sequence[str], starts: Sequence[Point]
    ) -> Sketch:
        """The best of some starts, improved by a few steps.

        Args:
            effects: those of the fit, then new ones.
            released: those of the fit, then new ones.
            starts: values of all effects' parameters.

        Raises:
            LinAlgError: the simulation diverges from every start.
        """
        free = Free(self.few, effects, released)
        noise = self.fit.noise
        tried = [self._value(free, free.clip(free.pack(p)), noise) for p in starts]
        good = [t for t in tried if np.isfinite(t[1])]
        if not good:
            raise np.linalg.LinAlgError("diverges from every start")
        vector, value, few = min(good, key=lambda t: t[1])
        vector, value = self._improve(few, free, vector, value, noise)
        return Sketch(tuple(effects), tuple(released), free.unpack(vector), value)

    def _value(
        self, free: Free, vector: FloatArray, noise: NoiseModel
    ) -> tuple[FloatArray, float, Problem]:
        few = settle_phases(self.few, free.unpack(vector), noise)
        return vector, objective(few, free, vector, noise)[0], few

    def _improve(
        self, few: Problem, free: Free, vector: FloatArray, value: float, noise: NoiseModel
    ) -> tuple[FloatArray, float]:
        old = self.known.shape[1]
        new = range(old, len(vector))
        filtered = few.filtered(free.unpack(vector), noise)
        for _ in range(STEPS):
            residuals, slopes = slopes_of(few, free, vector, noise, filtered, new)
            slopes = np.column_stack([self.known, slopes])
            hessian = information(slopes, free.prior)
            gradient = inner(slopes, residuals[:, None])[:, 0] + free.prior * vector
            before = value
            for trial, _ in free.trials(hessian, gradient, vector):
                reached, trial_filtered = objective(few, free, trial, noise)
                if reached < value:
                    vector, value, filtered = trial, reached, trial_filtered
                    break
            if before - value < SETTLED:
                break
        return vector, value
