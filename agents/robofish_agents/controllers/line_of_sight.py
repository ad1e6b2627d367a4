"""Line-of-sight guidance outside the environment, for any number of waypoints.

The geometry is that of :mod:`fish_env.envs.guidance`, which guides the fish of the task ``path``.
Here legs meet in corners without arcs. The position of the robot has to be known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.envs.plain_guidance import drift_rate, on_leg, steer
from fish_env.errors import ConfigError


@dataclass(frozen=True)
class Guided:
    """References of guidance at a point on a path.

    Attributes:
        heading: desired heading (rad, NED).
        depth: of the path abeam of the fish (m).
        depth_rate: at which that changes when swum at the given speed (m/s).
        cross_track: cross-track error, positive to starboard of the path (m).
        leg: number of the present leg, from 0.
        finished: whether the last waypoint is passed.
    """

    heading: float
    depth: float
    depth_rate: float
    cross_track: float
    leg: int
    finished: bool


class LineOfSight:
    """Guides one fish along straight legs between waypoints.

    Args:
        waypoints: (n, 3) north, east, depth (m), at least two, no two following ones above each
            other.
        lookahead: distance ahead on the path that is steered for (m); about three fish lengths.
        radius: a waypoint counts as reached this close to its plane (m).
        integral: gain of the integral of the cross-track error (m/s); 0 switches it off.

    Raises:
        ConfigError: the waypoints or distances do not define a path.
    """

    def __init__(
        self,
        waypoints: Sequence[Sequence[float]] | npt.ArrayLike,
        lookahead: float = 0.8,
        radius: float = 0.2,
        integral: float = 0.03,
    ) -> None:
        points = np.asarray(waypoints, float)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
            raise ConfigError(f"waypoints: at least two of north, east, depth; not {points.shape}")
        across = np.hypot(*np.diff(points[:, :2], axis=0).T)
        if not np.all(np.isfinite(points)) or np.any(across < 1e-6):
            raise ConfigError("waypoints must be finite, and no leg may go straight up or down")
        if lookahead <= 0 or radius < 0 or integral < 0:
            raise ConfigError("lookahead must be positive, radius and integral at least 0")
        self.points, self._lengths = points, across
        self.lookahead, self.radius, self.integral = lookahead, radius, integral
        self.reset()

    def reset(self) -> None:
        """Begins at the first leg."""
        self.leg = 0
        self._drift = 0.0

    def guide(self, position: npt.ArrayLike, speed: float, period_s: float) -> Guided:
        """Returns the references of this control step.

        Args:
            position: north, east, depth of the fish (m).
            speed: over ground (m/s).
            period_s: time since the last call (s).
        """
        place = np.asarray(position, float)
        along, across = self._on_leg(place)
        while self.leg < len(self._lengths) - 1 and along > self._lengths[self.leg] - self.radius:
            self.leg += 1
            along, across = self._on_leg(place)
        start, end = self.points[self.leg : self.leg + 2]
        length = self._lengths[self.leg]
        course = np.arctan2(end[1] - start[1], end[0] - start[0])
        rate = drift_rate(across, self._drift, self.lookahead, self.integral)
        self._drift += rate * period_s
        heading = steer(course, across, self._drift, self.lookahead)
        slope = (end[2] - start[2]) / length
        inside = 0.0 <= along <= length
        return Guided(
            heading=float(np.arctan2(np.sin(heading), np.cos(heading))),
            depth=float(start[2] + slope * np.clip(along, 0.0, length)),
            depth_rate=float(slope * speed) if inside else 0.0,
            cross_track=float(across),
            leg=self.leg,
            finished=self.leg == len(self._lengths) - 1 and along >= length,
        )

    def _on_leg(self, place: FloatArray) -> tuple[float, float]:
        """Returns the distances along the present leg and to starboard of it (m)."""
        start, end = self.points[self.leg : self.leg + 2, :2]
        ahead = (end - start) / self._lengths[self.leg]
        offset = place[:2] - start
        along, across = on_leg(*offset, *ahead)
        return float(along), float(across)
