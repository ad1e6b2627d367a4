"""Converts the observation vector of the environment to physical units, for controllers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.envs.layout import OBSERVATION


class Seen(NamedTuple):
    """What is observed, each (N,), SI and radians; see ``fish_env.envs.layout.OBSERVATION``.

    Errors are goal minus measured. Angular rates are in the body frame. Actuator positions and the
    last action, each (N, 5), are shares of their ranges, -1 to 1.
    """

    depth_error: FloatArray
    depth_rate: FloatArray
    goal_depth_rate: FloatArray
    tank_depth: FloatArray
    heading_error: FloatArray
    heading_error_instant: FloatArray
    goal_heading_rate: FloatArray
    speed_error: FloatArray
    goal_speed: FloatArray
    roll: FloatArray
    pitch: FloatArray
    surge: FloatArray
    sway: FloatArray
    heave: FloatArray
    roll_rate: FloatArray
    pitch_rate: FloatArray
    yaw_rate: FloatArray
    tail_phase: FloatArray
    actuators: FloatArray
    last_action: FloatArray

    def depth(self, top: float, bottom: float) -> FloatArray:
        """Returns the depth (m), from the depths (m) between which the fish may swim."""
        return (top + bottom) / 2 + (bottom - top) / 2 * self.tank_depth

    @classmethod
    def of(cls, observations: npt.ArrayLike) -> Seen:
        """Converts observations (N, 33); ``tank_depth`` stays -1 (top) to 1 (bottom).

        Raises:
            ValueError: another number of columns.
        """
        obs = np.asarray(observations, float)
        if obs.ndim != 2 or obs.shape[1] != len(OBSERVATION):
            raise ValueError(f"observations have shape (N, {len(OBSERVATION)}), not {obs.shape}")
        o = obs.T
        return cls(
            0.3 * o[0], 0.1 * o[1], 0.1 * o[2], o[3],
            np.arctan2(o[4], o[5]), np.arctan2(o[6], o[7]), 0.5 * o[8],
            0.1 * o[9], 0.1 * o[10],
            np.arctan2(o[11], o[12]), np.arctan2(o[13], o[14]),
            0.2 * o[15], 0.2 * o[16], 0.2 * o[17], o[18], o[19], o[20],
            np.arctan2(o[21], o[22]), obs[:, 23:28], obs[:, 28:33],
        )  # fmt: skip
