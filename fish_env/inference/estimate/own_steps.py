"""Each run as far along a joint step as its own numbers let it come."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import marginal_of, own_objectives
from fish_env.inference.estimate.joint_model import Joint, Model, evaluated, with_prior
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Problem

OWN_SHARES = (0.4, 0.0)
"""Parts of its own step that a run goes which loses by the whole."""
OWN_DAMPINGS = (0.0, 1.0, 10.0)
"""Damping of the steps that such a run then takes alone, from slopes where the shared ones led."""
ENOUGH = 1.0
"""Decrease of -2 log likelihood below which steps follow its roughness."""


def with_own_steps(
    model: Model, noise: Any, at: Joint, vector: FloatArray, own: FloatArray
) -> Joint:
    """Everything at a step, each run as far along its own part of it as its likelihood rises.

    A run with a sharp corner stays, or goes where it gains, and does not hold back the others.
    Where most runs lose, it is the step that is wrong.

    Args:
        model: about where the step begins.
        noise: noise model.
        at: where it begins.
        vector: (n,) shared parameters after it.
        own: (R, K) the runs' own numbers after it, in units of their spread.
    """
    free, point = model.free, model.free.unpack(vector)
    moved = at.problem.with_variation(model.numbers(own), point, noise, at.filtered)
    tried = evaluated(moved, free, vector, noise)
    if not tried.filtered:
        return tried
    lagging = Lagging(model, noise, at, vector, own, tried)
    if not lagging.runs or 2 * len(lagging.runs) > at.problem.run_count:
        return tried
    for share in OWN_SHARES:
        lagging.take(model.own.at + share * (own - model.own.at), at.filtered)
    with suppress(np.linalg.LinAlgError):  # where one of them diverges, what was reached counts
        lagging.step_alone()
    return lagging.joint()


class Lagging:
    """Runs that lose by a step, and numbers of their own by which they lose less.

    One run that its numbers hold in a minimum of its own would hold all others back.

    Args as for :func:`with_own_steps`, and what came of the whole step.

    Attributes:
        runs: those that still lose.
    """

    def __init__(
        self,
        model: Model,
        noise: Any,
        at: Joint,
        vector: FloatArray,
        own: FloatArray,
        tried: Joint,
    ) -> None:
        self.model, self.noise, self.at, self.vector = model, noise, at, vector
        self.point = model.free.unpack(vector)
        self.numbers, self.filtered = own.copy(), list(tried.filtered)
        self.values = tried.of_runs.copy()
        self.runs = self._losing(range(len(own)))

    def _losing(self, runs: Iterable[int]) -> list[int]:
        return [i for i in runs if not self.values[i] < self.at.of_runs[i] + ENOUGH]

    def _with(self, numbers: FloatArray, near: Sequence[Evaluation]) -> Problem:
        """The runs that lose, with some numbers (R, K)."""
        own = self.model.numbers(numbers)[self.runs]
        part = self.at.problem.some(self.runs)
        return part.with_variation(own, self.point, self.noise, [near[i] for i in self.runs])

    def take(self, numbers: FloatArray, near: Sequence[Evaluation]) -> bool:
        """Take over the numbers (R, K) of runs that lose less by them; whether any does."""
        if not self.runs:
            return False
        part = self._with(numbers, near)
        found = part.filtered(self.point, self.noise)
        values, gained = own_objectives(part, found, self.noise), False
        for i, evaluation, value in zip(self.runs, found, values, strict=True):
            if value < self.values[i]:
                self.numbers[i], self.filtered[i], self.values[i] = numbers[i], evaluation, value
                gained = True
        self.runs = self._losing(self.runs)
        return gained

    def step_alone(self) -> None:
        """Let each take steps by its own numbers, about where the shared parameters have moved."""
        slopes: Marginal | None = None
        for damping in OWN_DAMPINGS:
            if not self.runs:
                return
            if slopes is None:
                near = [self.filtered[i] for i in self.runs]
                part = self._with(self.numbers, self.filtered)
                slopes = marginal_of(part, self.point, self.noise, near)
                assert slopes is not None
                residuals = np.concatenate([run.residuals for run in near])
            moved = self.numbers.copy()
            moved[self.runs] = slopes.predicted(residuals, damping, self.model.least)
            if self.take(moved, self.filtered):
                slopes = None  # of fewer runs now, or where they no longer are

    def joint(self) -> Joint:
        """Everything where the step has led."""
        numbers = self.model.numbers(self.numbers)
        mixed = self.at.problem.with_variation(numbers, self.point, self.noise, self.at.filtered)
        value = with_prior(self.model.free, self.vector, self.values)
        return Joint(mixed, self.vector, self.filtered, value, self.values)
