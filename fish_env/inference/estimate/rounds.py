"""Rounds of a fit: the noise after each of them, and what the last one ends with."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import Free, objective, spread_of
from fish_env.inference.estimate.information import leverage
from fish_env.inference.estimate.joint_model import Joint
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.estimate.settle import predicted_variation
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Problem


class Reached(NamedTuple):
    """Where a round of a fit has led: the problem, the vector (n,), its noise, and the value.

    Before the first, without a noise and infinite.
    """

    problem: Problem
    vector: FloatArray
    noise: Any
    value: float


def last(
    reached: Reached, free: Free, noise: Any, filtered: Sequence[Evaluation]
) -> tuple[Problem, FloatArray, Slopes, Sequence[Evaluation], float, Marginal | None]:
    """What a fit ends with: under the last noise model, or under the one before if that is better.

    Noise is fitted to a few runs that stay as they are. All of them, with what they differ in
    integrated out, may be less likely under it.

    Args:
        reached: where the last round has led.
        free: the free parameters.
        noise: the noise model fitted there.
        filtered: the evaluation there, or none.
    """
    problem, vector, before, value = reached
    if noise is not before:
        # The numbers of runs were those that suit the noise before.
        point = free.unpack(vector)
        moved, _ = predicted_variation(problem, point, noise, nearby=True)
        found = evaluated_at(moved, free, vector, noise, filtered)
        if found[-2] < value:
            return moved, vector, *found
    return problem, vector, *evaluated_at(problem, free, vector, before, filtered)


def evaluated_at(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: Any,
    near: Sequence[Evaluation] = (),
) -> tuple[Slopes, Sequence[Evaluation], float, Marginal | None]:
    """The slopes, evaluation and objective at a vector, what runs differ in integrated out."""
    slopes = Slopes(free, noise)
    value, filtered = objective(problem, free, vector, noise, near=near)
    if not spread_of(problem, noise).any():
        return slopes, filtered, value, None
    marginal = slopes.marginal(problem, vector, filtered)
    assert marginal is not None
    at = Joint.of(problem, free, vector, filtered, noise)
    return slopes, filtered, at.marginal_value(marginal), marginal


def noise_of(
    slopes: Slopes,
    problem: Problem,
    vector: FloatArray,
    filtered: Sequence[Evaluation],
    final: bool,
) -> Any:
    """The noise model that suits an evaluation.

    Args:
        slopes: under the noise model so far.
        problem: the problem.
        vector: (n,) where it was evaluated.
        filtered: the evaluation.
        final: whether the parameters are near their estimates.
    """
    followed = partial(_leverage, slopes, problem, vector, filtered)
    point = slopes.free.unpack(vector)
    return problem.fitted_noise(point, slopes.noise, final, filtered, followed)


def _leverage(
    slopes: Slopes, problem: Problem, vector: FloatArray, filtered: Sequence[Evaluation]
) -> FloatArray:
    """Share of each residual that the free parameters follow (D,)."""
    return leverage(slopes.exact(problem, vector, filtered).slopes, slopes.free.prior)
