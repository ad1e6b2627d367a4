"""Where the compiled environment step finds things: rows of arrays, in one place.

``SETUP`` are numbers that all fish of a batch share, ``GOAL`` the goal of each fish, ``OUTPUTS``
what a step reports in ``info``, ``OBSERVATION`` what the agent sees.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

MAX_BEAT_S = 1.5
"""Longest window (s) over which a heading counts as "over the last beat" (0.67 Hz and slower)."""

REFERENCE = (
    "base",
    "step",
    "step_time",
    "ramp_rate",
    "ramp_start",
    "ramp_end",
    "sine_amplitude",
    "sine_frequency",
    "sine_phase",
)
"""A reference signal: base + step after step_time + ramp between two times + sine (SI, s, Hz)."""

GOAL = (
    *(f"depth_{name}" for name in REFERENCE),
    *(f"heading_{name}" for name in REFERENCE),
    "cruise_speed",
)

OUTPUTS = (
    "reward_depth",
    "reward_heading",
    "reward_speed",
    "cost_power",
    "cost_action",
    "depth_error",
    "heading_error",
    "heading_error_instant",
    "speed_error",
    "depth",
    "heading",
    "speed",
    "goal_depth",
    "goal_heading",
    "goal_speed",
    "north",
    "east",
    "power",
    "within_tolerance_s",
    "is_success",
    "failure",
    "time_s",
)
"""Keys of ``info``, all SI and radians; see the class docstring of the environment."""

OBSERVATION = (
    ("depth error (goal - depth)", "0.3 m"),
    ("rate of depth", "0.1 m/s"),
    ("rate of the goal depth", "0.1 m/s"),
    ("depth, -1 at the top and 1 at the bottom of the tank", "half of the tank"),
    ("sine of the heading error over the last beat", "1"),
    ("cosine of the heading error over the last beat", "1"),
    ("sine of the instantaneous heading error", "1"),
    ("cosine of the instantaneous heading error", "1"),
    ("rate of the goal heading", "0.5 rad/s"),
    ("speed error (goal - surge speed over the last beat)", "0.1 m/s"),
    ("goal speed", "0.1 m/s"),
    ("sine of roll", "1"),
    ("cosine of roll", "1"),
    ("sine of pitch", "1"),
    ("cosine of pitch", "1"),
    ("surge speed over ground, body frame", "0.2 m/s"),
    ("sway speed over ground, body frame", "0.2 m/s"),
    ("heave speed over ground, body frame", "0.2 m/s"),
    ("roll rate", "1 rad/s"),
    ("pitch rate", "1 rad/s"),
    ("yaw rate", "1 rad/s"),
    ("sine of the tail phase", "1"),
    ("cosine of the tail phase", "1"),
    ("tail offset now", "action range"),
    ("tail amplitude now", "action range"),
    ("tail frequency now", "action range"),
    ("block displacement now", "action range"),
    ("block angle now", "action range"),
    ("last action: tail offset", "1"),
    ("last action: tail amplitude", "1"),
    ("last action: tail frequency", "1"),
    ("last action: block displacement", "1"),
    ("last action: block angle", "1"),
)
"""Index by index: what it is, and the value that is scaled to one."""

OBSERVATION_LIMIT = 10.0
"""Observations are clipped to this, so that the space is finite."""

SENSORS = ("depth", "depth_rate", "roll", "pitch", "heading", "u", "v", "w", "p", "q", "r")
"""Sensors that carry noise, in the order of the noise array."""


class Failure(IntEnum):
    """Why an episode terminated (``info["failure"]``)."""

    NONE = 0
    SURFACE = 1
    BOTTOM = 2
    WALL = 3
    TUMBLED = 4
    DIVERGED = 5


class Setup(IntEnum):
    """Index of each shared number in the setup array."""

    DT = 0
    CENTRE = 1
    HALF_RANGE = 6
    TOP = 11
    BOTTOM = 12
    NORTH_MIN = 13
    NORTH_MAX = 14
    EAST_MIN = 15
    EAST_MAX = 16
    TUMBLE_COSINE = 17
    WEIGHT_DEPTH = 18
    WEIGHT_HEADING = 19
    WEIGHT_SPEED = 20
    WEIGHT_POWER = 21
    WEIGHT_ACTION = 22
    MARGIN_DEPTH = 23
    MARGIN_HEADING = 24
    MARGIN_SPEED = 25
    POWER_SCALE = 26
    TOLERANCE_DEPTH = 27
    TOLERANCE_HEADING = 28
    TOLERANCE_SPEED = 29
    TOLERANCE_SPEED_FLOOR = 30
    SUCCESS_TIME = 31


SETUP_SIZE = len(Setup) + 8
"""Two of the entries, CENTRE and HALF_RANGE, are five numbers long."""


def empty_setup() -> np.ndarray:
    """A setup array of zeros."""
    return np.zeros(SETUP_SIZE)
