"""What the parameters of a fish say about it before it swims anywhere: trim, stability, speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.model.frames import quaternion_from_euler
from fish_env.params import FishParams
from fish_env.simulator import Simulator
from fish_env.steady import steady_motion

AMPLITUDES_DEG = (10.0, 20.0, 30.0, 40.0)
FREQUENCIES_HZ = (0.5, 1.0, 1.5, 2.0, 3.0)
BRACKET_ANGLES_DEG = (-40.0, -20.0, 0.0, 20.0, 40.0)
_NOT_FROM_WATER = ("gravity", "buoyancy", "inertial")
_NOSE_DOWN = (0.0, -np.pi / 2, 0.0)
_PROBE_SPEED, _PROBE_ANGLE = 0.2, 1e-3


@dataclass(frozen=True)
class Trim:
    """Attitude of the fish at rest with its tail still.

    Attributes:
        block: Displacement (m) or bracket angle (rad) of the weight block.
        centre: Centre of mass from O_b, body frame, m.
        angle: Pitch or roll, rad.
    """

    block: float
    centre: FloatArray
    angle: float


@dataclass(frozen=True)
class StaticMargins:
    """Does the fish turn back into the flow by itself?

    Attributes:
        righting: Moment that gravity brings back per angle of pitch, N m/rad.
        pitch: Distance of the centre of mass ahead of the point where the water's force acts when
            the fish heaves, m; negative is unstable without the righting moment.
        yaw: The same when it sways.
        critical_speed: Speed above which the water's pitching moment beats the righting moment,
            m/s; infinite if it never does.
    """

    righting: float
    pitch: float
    yaw: float
    critical_speed: float


def centre_of_mass(
    simulator: Simulator, displacement: float = 0.0, angle: float = 0.0
) -> FloatArray:
    """Centre of mass from O_b, body frame, shape (3,), m; effects that shift it count.

    Read off the moment of gravity C_m x F_g, once level and once with the nose straight down.
    """
    inputs = (0.0, 0.0, 0.0, displacement, angle)
    level = simulator.wrench_by_term(_state((0.0, 0.0, 0.0)), inputs)["gravity"]
    diving = simulator.wrench_by_term(_state(_NOSE_DOWN), inputs)["gravity"]
    weight = level[2]
    return np.array([-level[4] / weight, level[3] / weight, diving[4] / weight])


def trim_pitch(simulator: Simulator, displacement: float) -> Trim:
    """Pitch at which the fish hangs: tan(theta) = -C_mx / sqrt(C_my^2 + C_mz^2).

    At rest the only moment about O_b is C_m x F_g, so the body's downward direction
    (-sin theta, sin phi cos theta, cos phi cos theta) must point along C_m.
    """
    centre = centre_of_mass(simulator, displacement)
    return Trim(displacement, centre, float(-np.arctan2(centre[0], np.hypot(*centre[1:]))))


def trim_roll(simulator: Simulator, bracket_angle: float) -> Trim:
    """Roll at which the fish hangs: tan(phi) = C_my / C_mz, see :func:`trim_pitch`."""
    centre = centre_of_mass(simulator, angle=bracket_angle)
    return Trim(bracket_angle, centre, float(np.arctan2(centre[1], centre[2])))


def static_margins(simulator: Simulator) -> StaticMargins:
    """Slopes of the water's forces and moments at a small incidence, tail in the middle."""
    centre = centre_of_mass(simulator)
    small = _PROBE_SPEED * _PROBE_ANGLE
    heaving, swaying = _water(simulator, w=small), _water(simulator, v=small)
    weight = simulator.fish.get("mass.total") * simulator.fish.get("water.gravity")
    righting = float(weight * centre[2])
    # Moment per (m/s)^2 and radian of incidence; positive pitches away from the flow.
    slope = heaving[4] / (_PROBE_ANGLE * _PROBE_SPEED**2)
    return StaticMargins(
        righting=righting,
        pitch=float(centre[0] + heaving[4] / heaving[2]),
        yaw=float(centre[0] - swaying[5] / swaying[1]),
        critical_speed=float(np.sqrt(righting / slope)) if slope > 0.0 < righting else np.inf,
    )


def cruise_speeds(fish: FishParams) -> FloatArray:
    """Steady horizontal speed over `AMPLITUDES_DEG` (rows) and `FREQUENCIES_HZ`, m/s."""
    commands = [
        [0.0, np.radians(amplitude), frequency, 0.0, 0.0]
        for amplitude in AMPLITUDES_DEG
        for frequency in FREQUENCIES_HZ
    ]
    motion = steady_motion(fish, commands, tolerance=1e-3)
    return motion["horizontal_speed"].reshape(len(AMPLITUDES_DEG), len(FREQUENCIES_HZ))


def _state(euler: tuple[float, float, float], v: float = 0.0, w: float = 0.0) -> FloatArray:
    state = np.zeros(13)
    state[3:7] = quaternion_from_euler(euler)
    state[7:10] = (_PROBE_SPEED, v, w)
    return state


def _water(simulator: Simulator, v: float = 0.0, w: float = 0.0) -> FloatArray:
    """Force and moment about O_b of everything the water does, beyond that at zero incidence."""

    def total(state: FloatArray) -> FloatArray:
        terms = simulator.wrench_by_term(state)
        wrenches = [x for name, x in terms.items() if name not in _NOT_FROM_WATER]
        return np.asarray(np.sum(wrenches, axis=0))

    level = (0.0, 0.0, 0.0)
    return total(_state(level, v, w)) - total(_state(level))
