"""The crank-slider that moves the weight block (paper figure 4), in both directions.

s_w = l1 cos xi3 + sqrt(l2^2 - l1^2 sin^2 xi3), up to the constant that makes xi3 = pi/2 the rest
position, so the displacement is dd(xi3) = s_w(xi3) - s_w(pi/2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.errors import ScheduleError


@dataclass(frozen=True)
class CrankSlider:
    """Crank of length ``l1`` and rod of length ``l2`` (m), l1 < l2."""

    l1: float
    l2: float

    @property
    def rest(self) -> float:
        """s_w at xi3 = pi/2 (m)."""
        return float(np.sqrt(self.l2**2 - self.l1**2))

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest displacement (m), at xi3 = pi and xi3 = 0."""
        return self.l2 - self.l1 - self.rest, self.l2 + self.l1 - self.rest

    def displacement(self, motor_angle: npt.ArrayLike) -> FloatArray:
        """Block displacement dd (m) at motor-3 angles xi3 (rad)."""
        angle = np.asarray(motor_angle, float)
        rod = np.sqrt(self.l2**2 - (self.l1 * np.sin(angle)) ** 2)
        return np.asarray(self.l1 * np.cos(angle) + rod - self.rest)

    def motor_angle(self, displacement: npt.ArrayLike) -> FloatArray:
        """Motor-3 angle xi3 in [0, pi] (rad) that gives a displacement (m), by the law of cosines.

        Raises:
            ScheduleError: a displacement beyond the linkage's reach.
        """
        low, high = self.reach
        value = np.asarray(displacement, float)
        outside = (value < low - 1e-12) | (value > high + 1e-12) | np.isnan(value)
        if np.any(outside):
            worst = value[outside].flat[0]
            raise ScheduleError(
                f"block displacement {worst:g} m is beyond the crank's reach; "
                f"choose a value between {low:.4f} and {high:.4f} m"
            )
        stroke = value + self.rest
        cosine = (self.l1**2 + stroke**2 - self.l2**2) / (2 * self.l1 * stroke)
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))
