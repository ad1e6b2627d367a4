"""Order of the state: rows of every state array, shape (rows, fish)."""

from __future__ import annotations

BASE_STATES = (
    "x",
    "y",
    "z",
    "qw",
    "qx",
    "qy",
    "qz",
    "u",
    "v",
    "w",
    "p",
    "q",
    "r",
    "tail_phase",
    "heading_cosine_integral",
    "heading_sine_integral",
    "surge_integral",
    "tail_energy",
)
"""Pose and velocities (m, m/s, rad/s; see the model page), tail phase (rad), then four running
integrals: of the horizontal unit vector of the heading (s), of the surge speed over ground
(m), and of the tail servo's mechanical power (J). Means over a tail beat are their differences."""

DYNAMIC_ROWS = 14
INTEGRAL_ROW = 14
INTEGRALS = 4

INPUTS = (
    "tail_offset",
    "tail_amplitude",
    "tail_frequency",
    "block_displacement",
    "block_angle",
)
"""Commands and actuator positions (rad, rad, Hz, m, rad)."""
