"""Minimum of a quadratic model within a box: a primal active-set method.

The method walks from one feasible point to the next. It holds the bounds that it meets, and it
releases a bound whose multiplier shows that the model falls inwards (Nocedal and Wright, Numerical
Optimization, 2006, section 16.5). Clipping an unconstrained step is no substitute: it changes the
direction, and the free unknowns then stop far from where they want to be.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.linalg import LinAlgError, eigh
from scipy.linalg.lapack import dposv
from scipy.optimize import lsq_linear

from fish_env.arrays import BoolArray, FloatArray

SignArray = npt.NDArray[np.int8]
Found: TypeAlias = tuple[FloatArray, SignArray]
"""A point, and its active bounds as those of :class:`BoxMinimum`."""
CHANGES_PER_UNKNOWN = 4
"""Most changes of the active set per unknown, before the library's solver takes over."""
KKT_TOLERANCE = 1e-10
"""Share of the terms of a gradient that may be rounding."""
SMALLEST_EIGENVALUE = 1e-14
"""Of a curvature with unit diagonal, for the library's solver: smaller ones are rounding."""


class BoxMinimum(NamedTuple):
    """The minimum of a quadratic model within a box.

    Attributes:
        step: (n,) the minimum; active unknowns are exactly at their bounds.
        active: (n,) -1 where the lower bound is active, 1 where the upper one is, else 0. Where
            both bounds are equal, it is the one that the gradient points to.
    """

    step: FloatArray
    active: SignArray


class BoxModel(NamedTuple):
    """A quadratic model of unit diagonal and its box."""

    curvature: FloatArray
    gradient: FloatArray
    lower: FloatArray
    upper: FloatArray

    def by_active_set(self) -> Found | None:
        """The minimum and its active bounds; None where rounding keeps it from being found."""
        everything = np.ones(len(self.gradient), bool)
        free = self._newton(everything, self.gradient)
        if free is None:
            return None
        x = np.clip(free, self.lower, self.upper)
        active = self._at_bounds(x)
        for _ in range(CHANGES_PER_UNKNOWN * len(x) + 1):
            open_ = active == 0
            move = self._newton(open_, self.gradient + self.curvature @ x)
            if move is None:
                return None
            ends = np.where(move > 0.0, self.upper, self.lower)
            room = np.full(len(x), np.inf)
            np.divide(ends - x, move, out=room, where=move != 0.0)
            blocking = int(np.argmin(room))
            share = min(max(room[blocking], 0.0), 1.0)
            x = np.clip(x + share * move, self.lower, self.upper)
            if share < 1.0:
                x[blocking] = ends[blocking]
                active[blocking] = 1 if move[blocking] > 0.0 else -1
                continue
            inward = self._inward(x, active)
            if not inward.any():
                return x, active
            active[int(np.argmax(inward))] = 0
        return None

    def by_library(self) -> Found:
        """The same by :func:`scipy.optimize.lsq_linear`, tiny eigenvalues raised."""
        values, vectors = eigh(self.curvature)
        root = np.sqrt(np.maximum(values, SMALLEST_EIGENVALUE * max(values[-1], 1.0)))
        apart = self.upper > self.lower
        x = np.where(apart, 0.0, self.lower)
        rows, target = root[:, None] * vectors.T, -(vectors.T @ self.gradient) / root
        active = np.zeros(len(x), np.int8)
        if apart.any():
            found = lsq_linear(
                rows[:, apart],
                target - rows @ x,
                (self.lower[apart], self.upper[apart]),
                method="bvls",
                max_iter=CHANGES_PER_UNKNOWN * len(x),
            )
            x[apart], active[apart] = found.x, found.active_mask
        return x, np.where(apart, active, self._at_bounds(x)).astype(np.int8)

    def is_minimum(self, x: FloatArray, active: SignArray) -> bool:
        """Whether a point meets the conditions of Karush, Kuhn and Tucker, but for rounding."""
        inside = ((x >= self.lower) & (x <= self.upper)).all()
        slope = self.gradient + self.curvature @ x
        flat = (np.abs(slope) <= self._rounding(x))[active == 0].all()
        return bool(inside and flat and not self._inward(x, active).any())

    def _newton(self, free: BoolArray, slope: FloatArray) -> FloatArray | None:
        """Step (n,) of the free unknowns to their minimum; None where Cholesky's method fails."""
        move = np.zeros(len(slope))
        if free.any():
            part = self.curvature if free.all() else self.curvature[np.ix_(free, free)]
            _, solution, failed = dposv(part, slope[free], lower=1)
            if failed or not np.isfinite(solution).all():
                return None
            move[free] = -solution
        return move

    def _at_bounds(self, x: FloatArray) -> SignArray:
        """The bounds that a point is at; of two that are equal, the one the slope points to."""
        active = (x >= self.upper).astype(np.int8) - (x <= self.lower).astype(np.int8)
        fixed = self.lower == self.upper
        down = self.gradient + self.curvature @ x > 0.0
        return np.where(fixed, np.where(down, -1, 1), active).astype(np.int8)

    def _inward(self, x: FloatArray, active: SignArray) -> FloatArray:
        """Slopes (n,) along which the model falls from an active bound inwards, zero elsewhere."""
        inward = active * (self.gradient + self.curvature @ x)
        keep = (inward > self._rounding(x)) & (self.upper > self.lower)
        return np.where(keep, inward, 0.0)

    def _rounding(self, x: FloatArray) -> FloatArray:
        """Slopes (n,) of this size may be rounding."""
        terms = np.abs(self.gradient) + np.abs(self.curvature) @ np.abs(x)
        return np.asarray(KKT_TOLERANCE * terms)


def minimise_in_box(
    curvature: FloatArray,
    gradient: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    method: Callable[[BoxModel], Found | None] = BoxModel.by_active_set,
    fallback: Callable[[BoxModel], Found] = BoxModel.by_library,
) -> BoxMinimum:
    """Minimise ``gradient @ s + s @ curvature @ s / 2`` over ``lower <= s <= upper``.

    Args:
        curvature: (n, n) symmetric positive definite; it may be singular to rounding.
        gradient: (n,) at zero, which need not be within the box.
        lower: (n,) lower bounds, minus infinity where there is none.
        upper: (n,) upper bounds, infinity where there is none.
        method: finds a minimum, or None; what it finds is checked.
        fallback: finds one where the method does not.

    Returns:
        The minimum and its active bounds.

    Raises:
        LinAlgError: curvature or gradient is not finite, or no curvature is positive definite
            with such a diagonal.
        ValueError: a lower bound is above its upper bound.
    """
    diagonal = np.diag(curvature)
    if not (np.isfinite(curvature).all() and np.isfinite(gradient).all() and (diagonal > 0).all()):
        raise LinAlgError("the curvature is not positive definite, or the gradient is not finite")
    if (lower > upper).any():
        i = int(np.argmax(lower > upper))
        raise ValueError(f"unknown {i}: lower bound {lower[i]} is above upper bound {upper[i]}")
    # Unit diagonal: unknowns of all sizes are then alike to tolerances and pivots.
    unit = 1.0 / np.sqrt(diagonal)
    model = BoxModel(curvature * unit * unit[:, None], gradient * unit, lower / unit, upper / unit)
    found = method(model) if len(gradient) else (gradient, gradient.astype(np.int8))
    if found is None or not model.is_minimum(*found):
        found = fallback(model)
    x, active = found
    step = np.clip(x * unit, lower, upper)
    step[active < 0], step[active > 0] = lower[active < 0], upper[active > 0]
    return BoxMinimum(step, active)
