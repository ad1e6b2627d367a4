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
    "kind",
    "place_north",
    "place_east",
    "path_radius",
    "path_pitch",
    "path_swing",
    "path_length",
    "path_points",
    "flow_north",
    "flow_east",
)
"""Of each fish, SI and radians.

``kind`` is a :class:`GoalKind`. A path begins at (place_north, place_east, depth_base) with the
course heading_base. On a circle, ``path_radius`` is positive where it turns to starboard,
``path_pitch`` is the depth gained in a turn, and ``path_swing`` the amplitude by which the depth
swings twice in a turn. ``flow`` is the mean current that guidance to a place knows of.
"""

MOST_WAYPOINTS = 32
"""Of one path, its start among them."""

WAYPOINTS = tuple(
    f"waypoint_{number}_{axis}"
    for number in range(1, MOST_WAYPOINTS)
    for axis in ("north", "east", "depth")
)
"""Waypoints after the start of a path, from that start (m): rows of their own, of paths alone."""

GUIDE = (
    "depth",
    "depth_rate",
    "heading",
    "heading_rate",
    "speed",
    "cross_track",
    "progress",
    "place_error",
    "along",
    "leg",
    "leg_start",
    "drift",
    "velocity_north",
    "velocity_east",
    "side",
)
"""The goal as it is now (SI, rad), then what guidance remembers from step to step."""

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
    "reward_place",
    "cross_track_error",
    "path_progress",
    "place_error",
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


class GoalKind(IntEnum):
    """What the goal of an episode is made of."""

    SIGNALS = 0
    """Depth and heading are signals over time."""
    CIRCLE = 1
    """A path around a circle, down, up or both: a helix or a figure of eight."""
    LEGS = 2
    """A path along straight legs between waypoints, with arcs where they meet."""
    PLACE = 3
    """A place to stay at."""


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
    WEIGHT_PLACE = 32
    MARGIN_PLACE = 33
    TOLERANCE_CROSS_TRACK = 34
    TOLERANCE_PLACE = 35
    LOOKAHEAD = 36
    INTEGRAL = 37
    CORNER = 38
    STATION_GAIN = 39
    STATION_CIRCLE = 40
    STATION_CALM = 41
    WEIGHT_WITHIN = 42


SETUP_SIZE = len(Setup) + 8
"""Two of the entries, CENTRE and HALF_RANGE, are five numbers long."""


def empty_setup() -> np.ndarray:
    """A setup array of zeros."""
    return np.zeros(SETUP_SIZE)
