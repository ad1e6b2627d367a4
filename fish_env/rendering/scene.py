"""What is to be drawn: one moment of a fish, and what stays the same around it.

A scene knows nothing of where it comes from: an environment, a simulated trajectory, a measured
run.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.model.frames import euler_from_quaternion
from fish_env.rendering.shape import FishShape

PICTURE_SIZE = (640, 480)
"""Width and height of a picture (pixels), unless another is asked for."""
NO_WAKE = np.zeros((0, 3))
REST = np.zeros(5)


@dataclass(frozen=True)
class Goal:
    """Where a fish is to be.

    Attributes:
        depth: m.
        heading: rad, from north to east.
        speed: m/s.
    """

    depth: float
    heading: float
    speed: float


@dataclass(frozen=True)
class Tank:
    """The water.

    Attributes:
        top: depth of the surface (m).
        bottom: depth of the floor (m).
        walls: least and largest north, least and largest east (m), or None.
    """

    top: float = 0.0
    bottom: float = 1.0
    walls: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Setting:
    """What does not change from scene to scene.

    Attributes:
        shape: size of the fish and its parts.
        tank: the water.
        low: (5,) least position of each actuator (rad, rad, Hz, m, rad).
        high: (5,) largest position of each actuator.
    """

    shape: FishShape
    tank: Tank = field(default_factory=Tank)
    low: FloatArray = field(default_factory=lambda: np.array([-0.6, 0.0, 0.0, -0.012, -0.7]))
    high: FloatArray = field(default_factory=lambda: np.array([0.6, 0.6, 3.0, 0.012, 0.7]))


@dataclass(frozen=True)
class Scene:
    """One moment of one fish; SI and radians, inertial NED, body frame forward-starboard-down.

    Attributes:
        time_s: s.
        position: (3,) of O_b (m).
        quaternion: (4,) scalar first, body to inertial.
        speed: surge speed over ground (m/s).
        tail_angle: angle of the tail about its joint (rad), positive with the fin to port.
        tail_phase: phase of the tail beat (rad), which says how to fill in between two scenes.
        actuators: (5,) positions in the order of :data:`fish_env.model.state.INPUTS`.
        wake: (n, 3) past positions, the oldest first (m).
        goal: where the fish is to be, or None.
        path: (n, 3) the path that it is to swim, or a ring around its place (m).
        label: a few words shown in the corner.
    """

    time_s: float
    position: FloatArray
    quaternion: FloatArray
    speed: float
    tail_angle: float
    tail_phase: float = 0.0
    actuators: FloatArray = field(default_factory=lambda: REST)
    wake: FloatArray = field(default_factory=lambda: NO_WAKE)
    goal: Goal | None = None
    label: str = ""
    path: FloatArray = field(default_factory=lambda: NO_WAKE)

    @cached_property
    def euler(self) -> FloatArray:
        """Roll, pitch, yaw (rad)."""
        return euler_from_quaternion(self.quaternion)

    @property
    def commanded_tail(self) -> float:
        """Tail angle of an ideal servo: offset + amplitude sin(phase) (rad)."""
        return float(self.actuators[0] + self.actuators[1] * np.sin(self.tail_phase))


def between(first: Scene, second: Scene, share: float) -> Scene:
    """A moment between two scenes, for smooth pictures.

    The tail follows its beat: offset, amplitude and phase are interpolated, not the angle, and
    so is the distance of the angle from what an ideal servo would show.

    Args:
        first: earlier scene.
        second: later scene; its goal and label are those of the moment. One that is not later,
            the start of another episode, is returned as it is.
        share: 0 at the first, 1 at the second.
    """
    if share >= 1.0 or second.time_s <= first.time_s:
        return second

    def mixed(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
        start, end = np.asarray(a, float), np.asarray(b, float)
        return np.asarray(start + share * (end - start))

    # A quaternion and its negative are the same attitude: take the nearer one.
    nearer = np.copysign(1.0, first.quaternion @ second.quaternion)
    attitude = mixed(first.quaternion, nearer * second.quaternion)
    rest = (s.tail_angle - s.commanded_tail for s in (first, second))
    ideal = replace(
        second,
        time_s=float(mixed(first.time_s, second.time_s)),
        position=mixed(first.position, second.position),
        quaternion=attitude / np.linalg.norm(attitude),
        speed=float(mixed(first.speed, second.speed)),
        tail_phase=float(mixed(first.tail_phase, second.tail_phase)),
        actuators=mixed(first.actuators, second.actuators),
        wake=first.wake,
    )
    return replace(ideal, tail_angle=ideal.commanded_tail + float(mixed(*rest)))
