"""Gauss-Newton within bounds: whole steps, then less of them, until none promises a gain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from fish_env.identification.bounded import bounded_minimum, spread

FloatArray = npt.NDArray[np.float64]
T = TypeVar("T")
SHARES = (1.0, 0.5, 0.2)
DAMPINGS = (0.1, 10.0)
NEAR, SLIGHT = 1.0, 0.1
"""Where the quadratic model promises less than the first (in -2 log likelihood), a shortened step
that gains less than the second follows the objective's roughness."""
AT = 0.01
"""A vector is at a bound when it is as near to it, in standard deviations."""


class Within(NamedTuple):
    """Where a vector may go: ``low <= rows @ vector <= high``.

    Attributes:
        rows: (m, n) what is bounded, independent.
        low: (m,) lower bounds.
        high: (m,) upper bounds.
        clip: the nearest vector (n,) that is allowed, whatever rounding makes of the bounds.
    """

    rows: FloatArray
    low: FloatArray
    high: FloatArray
    clip: Callable[[FloatArray], FloatArray]

    def step(self, hessian: FloatArray, gradient: FloatArray, vector: FloatArray) -> FloatArray:
        """The step (n,) to the minimum of the quadratic model."""
        bounds = (self.rows, self.low, self.high)
        return bounded_minimum(hessian, gradient, vector, *bounds)[0] - vector

    def held(self, hessian: FloatArray, gradient: FloatArray, vector: FloatArray) -> FloatArray:
        """The rows (k, n) whose bounds hold a vector back where it is, as walls do."""
        bounds = (self.rows, self.low, self.high)
        pressed = bounded_minimum(hessian, gradient, vector, *bounds)[1]
        ends = [self.high[i] if upper else self.low[i] for i, upper in pressed.items()]
        rows = self.rows[list(pressed)]
        near = AT * spread(rows, np.asarray(np.linalg.inv(hessian), float))
        return np.asarray(rows[np.abs(rows @ vector - ends) < near])


def descend(
    start: FloatArray,
    evaluate: Callable[[FloatArray], tuple[float, T]],
    linearise: Callable[[FloatArray, T], tuple[FloatArray, FloatArray]],
    within: Within,
    iterations: int,
    tolerance: float,
    hopeless: float = np.inf,
) -> tuple[FloatArray, float, T]:
    """Minimise a sum of squares, or what is nearly one.

    Args:
        start: (n,) where to begin.
        evaluate: the objective at a vector, and what else was computed there.
        linearise: half of the objective's Hessian (n, n), positive definite, and half of its
            gradient (n,) at a vector.
        within: bounds.
        iterations: most steps.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation, the objective being -2 log likelihood.
        hopeless: stop when the objective would stay above this if every step that is left gained
            what the next one promises.

    Returns:
        The vector reached, the objective there, and what else was computed.

    Raises:
        LinAlgError: the objective is not finite at the start.
    """
    vector = start
    value, known = evaluate(vector)
    if not np.isfinite(value):
        raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")
    for left in range(iterations, 0, -1):
        hessian, gradient = linearise(vector, known)
        whole = within.step(hessian, gradient, vector)
        promise = promised(hessian, gradient, whole)
        if promise < tolerance**2 or value - left * promise > hopeless:
            break
        before, tried = value, 0
        for trial in _trials(hessian, gradient, vector, whole, within):
            tried += 1
            trial_value, trial_known = evaluate(trial)
            if trial_value < value:
                vector, value, known = trial, trial_value, trial_known
                break
        rough = tried > 1 and promise < NEAR and before - value < SLIGHT
        if rough or value == before:
            break
    return vector, value, known


def promised(hessian: FloatArray, gradient: FloatArray, step: FloatArray) -> float:
    """By how much the quadratic model falls with a step.

    It bounds the square of how far any combination of the parameters moves, in its own standard
    deviations. The parameters one by one would not do: where two act alike both may go far for
    nothing.
    """
    return float(-2.0 * gradient @ step - step @ hessian @ step)


def _trials(
    hessian: FloatArray,
    gradient: FloatArray,
    vector: FloatArray,
    whole: FloatArray,
    within: Within,
) -> Iterator[FloatArray]:
    """Where to look for a lower objective: a whole step further, then less far.

    Shorter steps come before damped ones: damping would hold back directions that only the prior
    decides, such as the difference of two coefficients that act alike.
    """
    for share in SHARES:
        yield within.clip(vector + share * whole)
    for damping in DAMPINGS:
        damped = hessian + damping * np.diag(np.diag(hessian))
        yield within.clip(vector + within.step(damped, gradient, vector))
