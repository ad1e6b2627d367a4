"""A linear problem that stands in for a fit: residuals are y + S z, with z standard normal."""

from __future__ import annotations

import numpy as np

from fish_env.inference.estimate.bounds import LinearBounds
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.probes import Cause
from fish_env.inference.problem import Point
from tests.inference.stated import Stated, fit_of

BLOCKS, PER_BLOCK, COEFFICIENTS = 60, 20, 4
PATHS = tuple(f"c{i}" for i in range(COEFFICIENTS))


class LinearProblem:
    """Slopes and signals drawn once; data drawn as often as wanted."""

    def __init__(self, seed: int = 0, signals: int = 6, settings: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.size = BLOCKS * PER_BLOCK
        self.slopes = rng.standard_normal((self.size, COEFFICIENTS))
        shared = rng.standard_normal((self.size, 1))
        self.columns = [
            0.1 * (rng.standard_normal((self.size, settings)) + shared + self.slopes[:, [0]])
            for _ in range(signals)
        ]
        self.stated = Stated(lambda z, effects: (self.slopes @ z)[None], paths=PATHS)
        self.causes = [Cause(f"cause_{i}", (({"a": 1.0},),)) for i in range(signals)]

    def fit(
        self,
        rng: np.random.Generator,
        added: np.ndarray | float = 0.0,
        memory: float = 0.0,
        reach: float = np.inf,
    ) -> Fit:
        """A refitted baseline on new data, with a signal and coloured residuals if wanted.

        No coefficient goes further than ``reach``.
        """
        noise = rng.standard_normal(self.size)
        for i in range(1, self.size) if memory else ():
            noise[i] = memory * noise[i - 1] + np.sqrt(1 - memory**2) * noise[i]
        data = noise - self.slopes @ rng.standard_normal(COEFFICIENTS) + added
        hessian = self.slopes.T @ self.slopes + np.eye(COEFFICIENTS)
        gradient = self.slopes.T @ data
        ends = np.full(COEFFICIENTS, reach)
        bounds = LinearBounds(np.eye(COEFFICIENTS), -ends, ends)
        z = bounds.step(hessian, gradient, np.zeros(COEFFICIENTS))
        times = np.repeat(3.0 * np.arange(BLOCKS) + 1.0, PER_BLOCK)
        linearised = Linearised(
            data + self.slopes @ z, self.slopes, np.zeros(self.size, np.int64), times
        )
        active = bounds.active(hessian, gradient + hessian @ z, z)
        return fit_of(self.stated, point=Point(z, {}), linearised=linearised, active=active)
