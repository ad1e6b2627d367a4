"""Gauss-Newton within bounds: whole steps, then less of them, until none predicts a decrease."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TypeVar

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.bounds import LinearBounds

T = TypeVar("T")
Quadratic = tuple[FloatArray, FloatArray]
"""Half a Hessian (n, n), positive definite, and half a gradient (n,)."""
Linearise = Callable[[FloatArray, T], Quadratic]
SHARES = (1.0, 0.5, 0.2)
ON_A_LINE = 2
"""Points beside its begin that tell what a line gains."""
DAMPINGS = (0.1, 10.0)
NEAR, SLIGHT = 1.0, 0.1
"""If the decrease predicted is below the first (in -2 log likelihood), a shortened step that gains
less than the second follows the objective's roughness."""
AS_PROMISED = 0.75
"""Share of the predicted decrease that a step gains where the model is good (Nocedal and Wright,
"Numerical Optimization", 2006, algorithm 4.1)."""
LEAST_KEPT = 0.1
"""Share of what the linear model foresees below which it is of no use: where there is a sharp
corner, most of what is foreseen lies beyond it."""


def descend(
    start: FloatArray,
    evaluate: Callable[[FloatArray], tuple[float, T]],
    linearise: Linearise[T],
    bounds: LinearBounds,
    iterations: int,
    tolerance: float,
    give_up_above: float = np.inf,
    quickly: Linearise[T] | None = None,
) -> tuple[FloatArray, float, T]:
    """Minimise a sum of squares, or what is nearly one.

    Args:
        start: (n,) where to begin.
        evaluate: the objective at a vector, and what else was computed there.
        linearise: half of the objective's Hessian (n, n), positive definite, and half of its
            gradient (n,) at a vector.
        bounds: where the vector may go.
        iterations: most steps.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation, the objective being -2 log likelihood.
        give_up_above: stop when the objective would stay above this if every step that is left
            gained the decrease predicted for the next one, or the share of it that the last one
            by new slopes has kept.
        quickly: roughly the same as ``linearise``. Steps after one that gained what was predicted
            follow it; it ends no descent that the other would go on with.

    Returns:
        The vector reached, the objective there, and what else was computed.

    Raises:
        LinAlgError: the objective is not finite at the start.
    """
    vector = start
    value, known = evaluate(vector)
    if not np.isfinite(value):
        raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")
    left, exact, kept = iterations, True, 1.0
    while left:
        found = linearise if exact or quickly is None else quickly
        hessian, gradient = found(vector, known)
        whole = bounds.step(hessian, gradient, vector)
        predicted = predicted_decrease(hessian, gradient, whole)
        if value - left * kept * predicted > give_up_above:
            break
        before = value
        most = 0 if predicted < tolerance**2 else _most_trials(exact, predicted)
        trials = islice(_trials(hessian, gradient, vector, whole, bounds), most)
        (vector, value, known), tried = _first_lower(trials, evaluate, (vector, value, known))
        gained = before - value
        if exact and tried:  # of kept slopes, and of steps too small to take, nothing follows
            kept = kept_of(gained, predicted)
        rough = tried > 1 and predicted < NEAR and gained < SLIGHT
        if exact and (rough or not gained):
            break
        nearly_linear = gained > 0.0 and gained >= AS_PROMISED * predicted
        left -= int(exact or nearly_linear)
        exact = quickly is None or not nearly_linear
    return vector, value, known


def _first_lower(
    trials: Iterator[FloatArray],
    evaluate: Callable[[FloatArray], tuple[float, T]],
    begun: tuple[FloatArray, float, T],
) -> tuple[tuple[FloatArray, float, T], int]:
    """The first of some trials whose objective is lower, and how many were tried.

    Args:
        trials: vectors (n,), the first ones along a line by :data:`SHARES`.
        evaluate: the objective at a vector, and what else was computed there.
        begun: vector, objective and the rest where they begin, and stay if no trial is lower.
    """
    _, value, _ = begun
    tried, lost = 0, list[tuple[float, float]]()
    for trial in trials:
        tried += 1
        trial_value, trial_known = evaluate(trial)
        if trial_value < value:
            return (trial, trial_value, trial_known), tried
        if tried <= ON_A_LINE:
            lost.append((SHARES[tried - 1], trial_value - value))
        if tried == ON_A_LINE and most_gained(lost) < SLIGHT:
            break  # it is the minimum, but for what slopes leave out: how weights change
    return begun, tried


def predicted_decrease(hessian: FloatArray, gradient: FloatArray, step: FloatArray) -> float:
    """By how much the quadratic model falls with a step.

    It bounds the square of how far any combination of the parameters moves, in its own standard
    deviations. The parameters one by one would not do: where two act alike both may go far for
    nothing.
    """
    return float(-2.0 * gradient @ step - step @ hessian @ step)


def kept_of(gained: float, predicted: float) -> float:
    """Share of a predicted decrease that a step has kept: what promised too much will do so again.

    Args:
        gained: decrease of the objective.
        predicted: by the quadratic model.
    """
    return min(max(gained / predicted, LEAST_KEPT), 1.0) if predicted > 0.0 else 1.0


def most_gained(lost: Sequence[tuple[float, float]]) -> float:
    """The most that a line gains, by the parabola through its begin and two points.

    Args:
        lost: share of the way along it, and what the objective rises by, of each point.
    """
    if len(lost) < ON_A_LINE or not np.isfinite(lost).all():
        return np.inf
    (far, more), (near, less) = lost
    curvature = (more / far - less / near) / (far - near)
    slope = more / far - curvature * far
    if curvature <= 0.0:
        return np.inf
    return slope**2 / (4.0 * curvature) if slope < 0.0 else 0.0


def _most_trials(exact: bool, predicted: float) -> int | None:
    """How many steps to try: near the end, new slopes say more than shorter steps by kept ones."""
    return None if exact or predicted >= NEAR else 1


def _trials(
    hessian: FloatArray,
    gradient: FloatArray,
    vector: FloatArray,
    whole: FloatArray,
    bounds: LinearBounds,
) -> Iterator[FloatArray]:
    """Where to look for a lower objective: a whole step further, then less far.

    Shorter steps come before damped ones: damping would hold back directions that only the prior
    decides, such as the difference of two coefficients that act alike.
    """
    for share in SHARES:
        yield bounds.clip(vector + share * whole)
    for damping in DAMPINGS:
        damped = hessian + damping * np.diag(np.diag(hessian))
        yield bounds.clip(vector + bounds.step(damped, gradient, vector))
