"""Maximum likelihood of a noise model by Newton steps with the average information.

The likelihood of innovations is that of Gaussian numbers whose covariance, and a little their mean,
depend on the noise model. Differences of whitened innovations and of their whitening give score and
information together, so that a few steps find what a search by values alone takes hundreds of
evaluations for. Where a model is far off, innovations are much larger than expected. The expected
information then makes bold steps, and the average of the expected and the observed one makes
careful ones: the better of both is taken. Near the end neither is the curvature, as the model is
off there too. What they leave out is learnt from how the score changed by the steps so far.
Sources: Gupta and Mehra (1974), IEEE Transactions on Automatic Control 19, 774; Gilmour, Thompson
and Cullis (1995), Biometrics 51, 1440; Dennis, Gay and Welsch (1981), ACM Transactions on
Mathematical Software 7, 348.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.noise_information import products_of_changes
from fish_env.inference.estimate.box_qp import minimise_in_box
from fish_env.inference.parallel import side_by_side

STEP = 1e-3
"""By which a parameter, the logarithm of a size, is moved for a difference."""
MOST_STEPS = 8
BEYOND = 50.0
"""Log likelihood per unit of a logarithm with which a parameter pushes beyond its bound."""
LONGEST = 2.0
"""Of a step in a logarithm: from a quiet tank to one at the limit in two or three."""
FLATTEST = 0.05
"""Least curvature that is believed, over the least of the average information. What is wrongly
believed costs one replay, as the best of all steps is taken."""
ACROSS = 1e-6
"""Cosine between a step and what is learnt from it, below which nothing is (Nocedal and Wright,
2006, Numerical Optimization, section 6.2)."""


@dataclass(frozen=True, eq=False)
class Replayed:
    """What a noise model makes of innovations.

    Attributes:
        log_likelihood: without its constant.
        innovations: (T, C) whitened.
        whitening: (T, C, C) inverse Cholesky factors of their covariances.
    """

    log_likelihood: float
    innovations: FloatArray
    whitening: FloatArray


def climb(
    replay: Callable[[FloatArray], Replayed],
    start: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    least_gain: float,
    watched: int = 0,
) -> FloatArray:
    """Parameters (n,) of largest likelihood within bounds, from a start.

    The search ends as soon as one of the watched parameters is seen to belong beyond its bound:
    where the others would be the largest is then of no use.

    Args:
        replay: of parameters (n,), logarithms of sizes.
        start: (n,) within the bounds.
        lower: (n,) bounds.
        upper: (n,) bounds.
        least_gain: log likelihood for which a step is worth while.
        watched: how many of the first parameters are watched.
    """
    at, here = start, replay(start)
    last: tuple[FloatArray, FloatArray] | None = None
    unseen = np.zeros((len(at), len(at)))
    for _ in range(MOST_STEPS):
        with np.errstate(over="ignore", invalid="ignore"):
            system = _system(replay, at, here, upper, watched)
        if system is None:
            break
        if not np.isfinite(system.average).all():
            break  # the simulation has all but diverged: no noise model makes up for that
        low, high = np.maximum(lower - at, -LONGEST), np.minimum(upper - at, LONGEST)
        bold = minimise_in_box(system.expected, -system.score, low, high).step
        if system.gain(bold) < least_gain:
            break
        careful = minimise_in_box(system.average, -system.score, low, high).step
        tries = [bold, careful]
        if last is not None:
            unseen = system.unseen(unseen, at - last[0], last[1] - system.score)
            if system.believes(unseen):
                learnt = minimise_in_box(system.average + unseen, -system.score, low, high).step
                tries.append(learnt)
        last = at, system.score
        before = here.log_likelihood
        for steps in (tries, (0.3 * careful,)):
            for step in steps:
                tried = np.clip(at + step, lower, upper)
                there = replay(tried)
                if there.log_likelihood > here.log_likelihood:
                    nearer, here = tried, there
            if here.log_likelihood > before:
                at = nearer
                break
        if here.log_likelihood < before + least_gain:
            break
    return at


@dataclass(frozen=True, eq=False)
class System:
    """Quadratic models of a log likelihood.

    Attributes:
        score: (n,).
        expected: (n, n) information.
        average: (n, n) of the expected and the observed information.
    """

    score: FloatArray
    expected: FloatArray
    average: FloatArray

    def unseen(self, before: FloatArray, step: FloatArray, change: FloatArray) -> FloatArray:
        """What the average information leaves out of the curvature (n, n): symmetric, of rank one.

        Args:
            before: (n, n) what was known of it before a step.
            step: (n,) the step that led here.
            change: (n,) by how much the score fell along it.
        """
        left = change - (self.average + before) @ step
        along = float(left @ step)
        if abs(along) <= ACROSS * np.linalg.norm(left) * np.linalg.norm(step):
            return before
        return np.asarray(before + np.outer(left, left) / along)

    def believes(self, unseen: FloatArray) -> bool:
        """Whether the curvature with what the information leaves out is one of a maximum."""
        least = FLATTEST * np.linalg.eigvalsh(self.average)[0]
        return bool(np.linalg.eigvalsh(self.average + unseen)[0] > least)

    def gain(self, step: FloatArray) -> float:
        """Log likelihood that a step gains by the expected information."""
        return float(self.score @ step - 0.5 * step @ self.expected @ step)


def _system(
    replay: Callable[[FloatArray], Replayed],
    at: FloatArray,
    here: Replayed,
    upper: FloatArray,
    watched: int,
) -> System | None:
    """Score and information about parameters, by differences.

    None where one of the watched parameters belongs beyond its bound: one difference tells that,
    and all the others are then of no use.
    """
    count = len(at)
    by = np.where(at + STEP <= upper, STEP, -STEP)
    moved = [partial(replay, np.where(np.arange(count) == i, at + by, at)) for i in range(count)]
    found: dict[int, Replayed] = {}
    for i in np.flatnonzero((at >= upper)[:watched]).tolist():
        found[i] = moved[i]()
        if here.log_likelihood - found[i].log_likelihood > BEYOND * STEP:
            return None
    rest = [i for i in range(count) if i not in found]
    found |= zip(rest, side_by_side([moved[i] for i in rest]), strict=True)
    there = [found[i] for i in range(count)]
    score = np.array([one.log_likelihood - here.log_likelihood for one in there]) / by
    # A parameter that nothing depends on stays where it is.
    shared, spreads, seen = 1e-6 * np.eye(count), np.zeros((count, count)), np.zeros((count, count))
    products_of_changes(
        here.innovations, np.ascontiguousarray(here.whitening),
        np.array([one.innovations for one in there]),
        np.array([one.whitening for one in there]), by, shared, spreads, seen,
    )  # fmt: skip
    return System(score, 0.5 * spreads + shared, 0.5 * seen + shared)
