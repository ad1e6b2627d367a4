"""The words of the measured-data format: channels, commands, observations, and their ranges.

Everything here is in SI units and radians, in the frames of the model: inertial north, east,
down; body forward, starboard, down; Z-Y-X Euler angles.
"""

import math
from dataclasses import dataclass

FORMAT = "robotic-fish-measurements/1"

RATE_LIMIT = 35.0
"""rad/s. Rate gyros saturate at 2000 deg/s, so a larger reading can only be degrees."""

ANGLE_TOLERANCE = 0.02
"""rad. Sensor noise may carry an angle this far past the end of its range."""


HIGHEST = 0.5
"""m. How far above the surface a depth may be: a shifted zero, but no height for a depth."""


@dataclass(frozen=True)
class Quantity:
    """What a column holds.

    Attributes:
        dimension: "length", "angle", "speed", "rate", "frequency", "time" or "number".
        lower: Smallest possible value, SI.
        upper: Largest possible value, SI.
    """

    dimension: str
    lower: float = -math.inf
    upper: float = math.inf


def _symmetric(dimension: str, limit: float = math.inf) -> Quantity:
    return Quantity(dimension, -limit, limit)


_PITCH = _symmetric("angle", math.pi / 2 + ANGLE_TOLERANCE)

CHANNELS: dict[str, Quantity] = {
    "x": Quantity("length"),
    "y": Quantity("length"),
    "z": Quantity("length"),
    "roll": _symmetric("angle", math.pi + ANGLE_TOLERANCE),
    "pitch": _PITCH,
    "yaw": Quantity("angle"),
    "u": Quantity("speed"),
    "v": Quantity("speed"),
    "w": Quantity("speed"),
    "p": _symmetric("rate", RATE_LIMIT),
    "q": _symmetric("rate", RATE_LIMIT),
    "r": _symmetric("rate", RATE_LIMIT),
    "tail_angle": _symmetric("angle", math.pi),
}
"""Channels of a run as it is read, in this order: position of O_b, attitude, velocity and
angular velocity in the body frame, and the tail's angle."""

QUATERNION = ("qw", "qx", "qy", "qz")
"""Attitude as a quaternion, scalar first, body to inertial; read into roll, pitch and yaw."""

FILE_CHANNELS: dict[str, Quantity] = {
    **CHANNELS,
    "depth": Quantity("length", -HIGHEST),
    **{name: Quantity("number") for name in QUATERNION},
}
"""Channels a file may declare; depth becomes z, a quaternion becomes Euler angles."""

COMMANDS: dict[str, Quantity] = {
    "tail_offset": _symmetric("angle", math.pi / 2),
    "tail_amplitude": Quantity("angle", 0.0, math.pi / 2),
    "tail_frequency": Quantity("frequency", 0.0, 25.0),
    "block_displacement": _symmetric("length", 0.5),
    "block_angle": _symmetric("angle", math.pi),
}
"""Commands in the order of every command array, with what a fish's servos can be asked."""

OBSERVATIONS: dict[str, Quantity] = {
    "surge_speed": Quantity("speed"),
    "sway_speed": Quantity("speed"),
    "heave_speed": Quantity("speed"),
    "speed": Quantity("speed", 0.0),
    "yaw_rate": _symmetric("rate", RATE_LIMIT),
    "turn_radius": Quantity("length", 0.0),
    "pitch": _PITCH,
}
"""Observations of a table of steady motion. Speed and turn radius are magnitudes."""
