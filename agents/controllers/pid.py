"""Cascaded PID: depth through pitch through the weight block, heading through the tail offset.

It sees what any agent sees, the observation vector of ``RoboticFish3D-v0``, and needs no model of
the fish beyond the signs: a block further aft raises the nose, a positive tail offset turns the
fish to port.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Float32Array = npt.NDArray[np.float32]


@dataclass(frozen=True)
class PIDGains:
    """Gains, in physical units; outputs are actions in [-1, 1].

    Attributes:
        depth: climb rate asked for per metre of depth error (1/s).
        depth_integral: block action per metre and second of depth error.
        climb_limit: largest climb rate asked for (m/s).
        pitch_per_climb: pitch asked for per climb rate over surge speed (rad).
        pitch: block action per radian of pitch asked for.
        pitch_error: block action per radian of pitch error.
        pitch_rate: block action per pitch rate (s/rad).
        heading: offset action per radian of heading error.
        heading_rate: offset action per yaw rate error (s/rad).
        heading_integral: offset action per radian and second.
        frequency: tail frequency action at the goal speed 0.10 m/s.
        speed: frequency action per m/s of speed error.
        speed_integral: frequency action per m/s and second.
        amplitude: constant tail amplitude action.
        roll: block angle action per radian of roll.
    """

    depth: float = 0.25
    depth_integral: float = 0.12
    climb_limit: float = 0.04
    pitch_per_climb: float = 1.0
    pitch: float = 3.4
    pitch_error: float = 1.0
    pitch_rate: float = 0.8
    heading: float = 1.2
    heading_rate: float = 0.35
    heading_integral: float = 0.10
    frequency: float = 0.35
    speed: float = 3.0
    speed_integral: float = 1.5
    amplitude: float = 0.2
    roll: float = 0.0


class PIDController:
    """One fish's controller; call it with an observation (33,) and apply the action (5,).

    Args:
        gains: see :class:`PIDGains`.
        period_s: control period of the environment (s).
    """

    def __init__(self, gains: PIDGains | None = None, period_s: float = 0.1) -> None:
        self.gains = gains or PIDGains()
        self.period_s = period_s
        self.reset()

    def reset(self) -> None:
        """Forget the integrals, at the start of an episode."""
        self._depth = self._heading = self._speed = 0.0

    def __call__(self, observation: npt.ArrayLike) -> Float32Array:
        """Action for an observation."""
        obs = np.asarray(observation, float)
        action = np.array(
            [
                self._tail_offset(obs),
                self.gains.amplitude,
                self._tail_frequency(obs),
                self._block_displacement(obs),
                0.0,
            ]
        )
        return np.asarray(np.clip(action, -1.0, 1.0), np.float32)

    def _block_displacement(self, obs: npt.NDArray[np.float64]) -> float:
        gains = self.gains
        error, depth_rate = 0.3 * obs[0], 0.1 * obs[1]
        rate = np.clip(gains.depth * error, -gains.climb_limit, gains.climb_limit)
        rate = rate + 0.1 * obs[2]
        surge = max(0.2 * obs[15], 0.05)
        wanted = -gains.pitch_per_climb * np.clip((rate - 0.5 * depth_rate) / surge, -0.5, 0.5)
        pitch = np.arctan2(obs[13], obs[14])
        action = gains.pitch * wanted + gains.pitch_error * (wanted - pitch)
        action -= gains.pitch_rate * obs[19]
        if abs(error) < 0.15:
            step = gains.depth_integral * error * self.period_s
            self._depth = float(np.clip(self._depth - step, -0.4, 0.4))
        return float(action + self._depth)

    def _tail_offset(self, obs: npt.NDArray[np.float64]) -> float:
        gains = self.gains
        error = np.arctan2(obs[4], obs[5])
        rate_error = 0.5 * obs[8] - obs[20]
        if abs(error) < 0.3:
            step = gains.heading_integral * error * self.period_s
            self._heading = float(np.clip(self._heading + step, -0.3, 0.3))
        turn = gains.heading * error + gains.heading_rate * 0.2 * rate_error + self._heading
        return float(-turn)

    def _tail_frequency(self, obs: npt.NDArray[np.float64]) -> float:
        gains = self.gains
        error, goal = 0.1 * obs[9], 0.1 * obs[10]
        if goal <= 0.0 and error <= 0.0:
            return -1.0
        step = gains.speed_integral * error * self.period_s
        self._speed = float(np.clip(self._speed + step, -0.6, 0.6))
        feedforward = (gains.frequency + 1.0) * goal / 0.1 - 1.0
        return float(feedforward + gains.speed * error + self._speed)
