"""Where the picture is taken from, and where points of the water fall on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray

NEAR = 0.04
"""m. Nothing nearer to the eye is drawn."""
VIEW_ANGLE = np.radians(42.0)
"""From the top of the picture to its bottom."""
CLEARANCE = 0.04
"""m. The eye stays this far from the surface and the floor."""


@dataclass(frozen=True)
class Camera:
    """A pinhole that is never tilted sideways.

    Attributes:
        eye: (3,) m, inertial.
        axes: (3, 3) rows: ahead, right and down in the picture, unit vectors.
        width: pixels.
        height: pixels.
    """

    eye: FloatArray
    axes: FloatArray
    width: int
    height: int

    @classmethod
    def looking(cls, eye: FloatArray, target: FloatArray, size: tuple[int, int]) -> Camera:
        """A camera at one point that looks at another."""
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.array([-ahead[1], ahead[0], 0.0]) / np.hypot(ahead[0], ahead[1])
        return cls(eye, np.stack([ahead, right, np.cross(ahead, right)]), *size)

    @property
    def scale(self) -> float:
        """Pixels of one metre at a distance of one metre."""
        return float(0.5 * self.height / np.tan(0.5 * VIEW_ANGLE))

    def seen(self, points: FloatArray) -> FloatArray:
        """(..., 3) points as seen: distance ahead, to the right and down (m)."""
        away = (points - self.eye).reshape(-1, 3)
        return (away @ self.axes.T).reshape(points.shape)

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (..., 2) of points (..., 3), and their distances ahead (...,) (m)."""
        return self.pictured(self.seen(points))

    def pictured(self, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As :meth:`project`, of points (..., 3) as :meth:`seen`."""
        ahead = seen[..., 0]
        factor = self.scale / np.maximum(ahead, NEAR)
        middle = np.array([0.5 * self.width, 0.5 * self.height])
        return seen[..., 1:] * factor[..., None] + middle, ahead


class Follower:
    """Keeps a fish in the picture, smoothly, from behind and beside it.

    Attributes:
        azimuth: of the eye, from dead astern towards starboard (rad).
        elevation: of the eye above the fish (rad).
        distance: of the eye from the fish (m).
    """

    AZIMUTH, ELEVATION, LENGTHS = np.radians(60.0), np.radians(18.0), 3.0
    AHEAD, BELOW = 0.30, 0.16
    POSITION_LAG, HEADING_LAG, LONGEST_GAP = 0.25, 2.5, 2.0

    def __init__(self, length: float) -> None:
        self.length = length
        self.held = False
        self._time = np.inf
        self._target = np.zeros(3)
        self._heading = 0.0
        self.reset()

    def reset(self) -> None:
        """Back to the first view."""
        self.azimuth, self.elevation = float(self.AZIMUTH), float(self.ELEVATION)
        self.distance = self.LENGTHS * self.length
        self.held = False

    def orbit(self, azimuth: float, elevation: float) -> None:
        """Turn about the fish (rad); the eye may now leave the water."""
        self.azimuth += azimuth
        self.elevation = float(np.clip(self.elevation + elevation, -1.45, 1.45))
        self.held = True

    def zoom(self, factor: float) -> None:
        """Come nearer or go away."""
        low, high = 1.2 * self.length, 20.0 * self.length
        self.distance = float(np.clip(self.distance * factor, low, high))

    def follow(self, time_s: float, position: FloatArray, heading: float) -> None:
        """Take notice of where the fish is; a jump in time starts afresh."""
        step = time_s - self._time
        self._time = time_s
        if not 0.0 <= step <= self.LONGEST_GAP:
            self._target, self._heading = position.copy(), heading
            return
        turn = (heading - self._heading + np.pi) % (2.0 * np.pi) - np.pi
        self._target += (1.0 - np.exp(-step / self.POSITION_LAG)) * (position - self._target)
        self._heading += (1.0 - np.exp(-step / self.HEADING_LAG)) * turn

    def camera(self, size: tuple[int, int], top: float, bottom: float) -> Camera:
        """The camera of this moment; left alone, it stays in the water."""
        direction = self._heading + np.pi - self.azimuth
        level, up = np.cos(self.elevation), np.sin(self.elevation)
        offset = np.array([level * np.cos(direction), level * np.sin(direction), -up])
        # Looking ahead of the fish leaves room for where it goes, and below it for instruments.
        bow = np.array([np.cos(self._heading), np.sin(self._heading), 0.0])
        shift = self.AHEAD * bow + np.array([0.0, 0.0, self.BELOW])
        target = self._target + self.length * shift
        eye = target + self.distance * offset
        if not self.held:
            eye[2] = np.clip(eye[2], top + CLEARANCE, bottom - CLEARANCE)
        return Camera.looking(eye, target, size)
