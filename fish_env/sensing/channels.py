"""Channels of a measured run, computed from states."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.model.frames import euler_from_quaternion


def channels_from_states(states: FloatArray) -> dict[str, FloatArray]:
    """Pose and velocity channels of states.

    Args:
        states: (rows, ...) with the first 13 rows of :data:`fish_env.model.state.BASE_STATES`.

    Returns:
        ``x y z`` (m, inertial), ``roll pitch yaw`` (rad; yaw unwrapped along the first sample
        axis), ``u v w`` (m/s, body, over ground), ``p q r`` (rad/s, body), each of the shape of
        one row.
    """
    euler = np.moveaxis(euler_from_quaternion(np.moveaxis(states[3:7], 0, -1)), -1, 0)
    yaw = np.unwrap(euler[2], axis=0) if euler[2].ndim else euler[2]
    names = ("x", "y", "z", "u", "v", "w", "p", "q", "r")
    rows = (0, 1, 2, 7, 8, 9, 10, 11, 12)
    channels = {name: states[row] for name, row in zip(names, rows, strict=True)}
    return {**channels, "roll": euler[0], "pitch": euler[1], "yaw": yaw}
