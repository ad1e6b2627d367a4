"""How far free parameters may go, and steps that stay within: one policy for all fits.

Runs over time, tables of steady motion and fits to whole runs use the same bounds. A coefficient
stays within its physical bounds and within :data:`REACH` standard deviations of its prior. Both
are bounds of the coefficient itself. With a prior that correlates coefficients, they are no bounds
of the normalised numbers that a fit works with, so they stand as rows of the prior's full factor.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.box_qp import BoxMinimum, minimise_in_box
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.vehicle import Coefficients

MARGIN = 1e-3
"""Prior standard deviations that a fit stays away from the end of a coefficient's range."""
AT = 0.01
"""A vector is at a bound when it is as near to it, in standard deviations."""


class Gap(NamedTuple):
    """Values that a number must not have: a lag between off and where simulation steps are stable.

    Attributes:
        number: which; a row of its own bounds it.
        off: below the gap.
        least: above it.
    """

    number: int
    off: float
    least: float


@dataclass(frozen=True, eq=False)
class LinearBounds:
    """Where a vector may go: ``low <= rows @ vector <= high``, outside some gaps.

    Attributes:
        rows: (n, n) what is bounded, invertible.
        low: (n,) lower bounds.
        high: (n,) upper bounds.
        gaps: values between that are not allowed.
    """

    rows: FloatArray
    low: FloatArray
    high: FloatArray
    gaps: tuple[Gap, ...] = ()

    def beside(self, vector: FloatArray) -> LinearBounds:
        """The bounds of steps from a vector, whose numbers above a gap stay above it.

        Steps into a gap would be shortened until nothing else moves either. Whether what a number
        switches on is needed at all is asked elsewhere.
        """
        above = [gap for gap in self.gaps if vector[gap.number] >= gap.least]
        low = self.low.copy()
        low[[gap.number for gap in above]] = [gap.least for gap in above]
        return replace(self, low=low) if above else self

    @cached_property
    def inverse(self) -> FloatArray:
        """The vector (n, n) per unit of what is bounded."""
        return np.asarray(np.linalg.inv(self.rows), float)

    def clip(self, vector: FloatArray) -> FloatArray:
        """The vector (n,) with what is bounded moved to the nearest value allowed."""
        values = self.rows @ vector
        inside = np.clip(values, self.low, self.high)
        for number, off, least in self.gaps:
            if off < inside[number] < least:
                inside[number] = off if inside[number] - off < least - inside[number] else least
        unmoved = np.array_equal(inside, values)
        return vector.copy() if unmoved else np.asarray(self.inverse @ inside)

    def step(self, hessian: FloatArray, gradient: FloatArray, vector: FloatArray) -> FloatArray:
        """The step (n,) to the minimum of the quadratic model within the bounds."""
        return np.asarray(self.inverse @ self._minimum(hessian, gradient, vector).step)

    def active(self, hessian: FloatArray, gradient: FloatArray, vector: FloatArray) -> FloatArray:
        """The rows (k, n) whose bounds are active at a vector and hold it where it is."""
        found = self._minimum(hessian, gradient, vector)
        sd = np.sqrt(np.diag(self.rows @ np.linalg.solve(hessian, self.rows.T)))
        return np.asarray(self.rows[(found.active != 0) & (np.abs(found.step) < AT * sd)])

    def _minimum(self, hessian: FloatArray, gradient: FloatArray, vector: FloatArray) -> BoxMinimum:
        """Minimum over what is bounded, relative to its value at the vector."""
        values = self.rows @ vector
        curvature = self.inverse.T @ hessian @ self.inverse
        box = self.low - values, self.high - values
        return minimise_in_box(0.5 * (curvature + curvature.T), self.inverse.T @ gradient, *box)


def coefficient_range(
    baseline: Coefficients, released: Iterable[Coefficient] = ()
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest value of each coefficient, each (n,), in its own unit.

    Args:
        baseline: coefficients and their prior.
        released: coefficients whose prior is lifted; only physical bounds hold them.
    """
    low, high = baseline.bounds
    free = set(released)
    reach = (
        np.array([np.inf if c in free else POLICY.prior_reach_sd for c in baseline.ids])
        * baseline.sd
    )
    return np.maximum(low, baseline.mean - reach), np.minimum(high, baseline.mean + reach)


def coefficients_at_bounds(
    baseline: Coefficients, values: FloatArray, released: Iterable[Coefficient] = ()
) -> list[Coefficient]:
    """Coefficients that are at an end of their range.

    Args:
        baseline: coefficients and their prior.
        values: (n,) in their own units.
        released: coefficients whose prior is lifted.
    """
    low, high = coefficient_range(baseline, released)
    margin = 2.0 * MARGIN * baseline.sd
    stuck = (values <= low + margin) | (values >= high - margin)
    return [one for one, at in zip(baseline.ids, stuck.tolist(), strict=True) if at]


def parameter_bounds(
    baseline: Coefficients,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    released: Iterable[Coefficient] = (),
) -> LinearBounds:
    """Bounds of a vector of normalised coefficients, then further numbers.

    Args:
        baseline: coefficients and their prior.
        lower: (m,) lower bounds of the further numbers.
        upper: (m,) upper bounds of the further numbers.
        released: coefficients whose prior is lifted.
    """
    low, high = coefficient_range(baseline, released)
    margin, count = MARGIN * baseline.sd, len(baseline)
    below = np.r_[low + margin - baseline.mean, np.asarray(lower, float)]
    above = np.r_[high - margin - baseline.mean, np.asarray(upper, float)]
    rows = np.eye(len(below))
    rows[:count, :count] = baseline.factor
    return LinearBounds(rows, below, above)
