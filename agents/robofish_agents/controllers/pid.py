"""Cascaded PID: depth through pitch through the weight block, heading through the tail offset.

It uses the observation vector of ``RoboticFish3D-v0``, as any agent does. Of the fish it needs only
the signs: a block further aft raises the nose, a positive tail offset turns the
fish to port. The gains come from configs/controllers/pid.yaml, which scripts/tune_pid.py writes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from fish_env.arrays import BoolArray, FloatArray
from fish_env.errors import ConfigError
from fish_env.params.io import config_root
from robofish_agents.controllers.seen import Seen

Float32Array = npt.NDArray[np.float32]
Gain = float | FloatArray
"""A number, or one for each fish (N,)."""
DEPTH_WINDOW, HEADING_WINDOW = 0.15, 0.3
"""Errors (m, rad) within which the integrals grow."""
HEADING_WINDUP, SPEED_WINDUP = 0.3, 0.6
"""The action that the integrals of heading and speed may amount to."""
LARGEST_EXTRA_SPEED = 0.015
"""Most (m/s) that is asked for beyond the goal speed."""
SLOWEST_SURGE = 0.05
"""Least surge speed (m/s) that a wanted climb is divided by to give a pitch."""


@dataclass(frozen=True)
class PIDGains:
    """Gains in physical units; outputs are actions in [-1, 1].

    Attributes:
        depth: desired climb rate per metre of depth error (1/s).
        depth_integral: block action per metre and second of depth error.
        depth_windup: limit of the integral of depth, in block action.
        climb_limit: largest desired climb rate (m/s), in addition to that of the goal.
        climb_damping: reduction of the desired climb rate per climb rate.
        pitch: block action per radian of desired pitch.
        pitch_error: block action per radian of pitch error.
        pitch_rate: block action per pitch rate (s/rad).
        heading: offset action per radian of heading error.
        heading_rate: offset action per yaw rate (s/rad).
        heading_feedforward: offset action per rate of the goal heading (s/rad).
        heading_integral: offset action per radian and second.
        frequency: tail frequency action at the goal speed 0.10 m/s.
        speed: frequency action per m/s of speed error.
        speed_integral: frequency action per m/s and second.
        speed_for_climb: speed asked for beyond the goal (m/s) per block action beyond its range: a
            block at its end lifts more at more speed.
        amplitude: constant tail amplitude action.
        roll: block angle action per radian of roll.
    """

    depth: Gain
    depth_integral: Gain
    depth_windup: Gain
    climb_limit: Gain
    climb_damping: Gain
    pitch: Gain
    pitch_error: Gain
    pitch_rate: Gain
    heading: Gain
    heading_rate: Gain
    heading_feedforward: Gain
    heading_integral: Gain
    frequency: Gain
    speed: Gain
    speed_integral: Gain
    speed_for_climb: Gain
    amplitude: Gain
    roll: Gain


GAIN_NAMES = tuple(field.name for field in fields(PIDGains))


@cache
def tuned_gains() -> PIDGains:
    """Returns the gains that come with the package."""
    return load_gains(config_root() / "controllers" / "pid.yaml")


def load_gains(path: Path) -> PIDGains:
    """Reads gains from a YAML file.

    Raises:
        ConfigError: the file is missing, or does not have one number for each gain.
    """
    if not path.is_file():
        raise ConfigError(f"{path}: no such file; scripts/tune_pid.py writes one")
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    gains: Mapping[str, Any] = tree.get("gains", {}) if isinstance(tree, dict) else {}
    wrong = set(gains) ^ set(GAIN_NAMES)
    wrong |= {name for name, value in gains.items() if not isinstance(value, (int, float))}
    if wrong:
        raise ConfigError(f"{path}: 'gains' needs a number for each gain; see {sorted(wrong)}")
    return PIDGains(**gains)


class PIDController:
    """Controls a batch of fish. Each fish has its own integrals.

    Args:
        gains: default: those that come with the package.
        period_s: control period of the environment (s).

    Attributes:
        speed_window: speed error (m/s) within which the integral of speed grows.
    """

    speed_window = np.inf

    def __init__(self, gains: PIDGains | None = None, period_s: float = 0.1) -> None:
        self.gains = gains or tuned_gains()
        self.period_s = period_s
        self.reset(1)

    def reset(self, count: int) -> None:
        """Resets the integrals at the start of the episodes of ``count`` fish."""
        self._depth, self._heading, self._speed = np.zeros((3, count))

    def act(self, observations: npt.ArrayLike) -> Float32Array:
        """Returns actions (N, 5) for observations (N, 33)."""
        seen = Seen.of(observations)
        actions = np.zeros((len(seen.depth_error), 5))
        block = self._block_displacement(seen)
        beyond = self.gains.speed_for_climb * np.maximum(np.abs(block) - 1.0, 0.0)
        actions[:, 0] = self._tail_offset(seen)
        actions[:, 1] = self.gains.amplitude
        actions[:, 2] = self._tail_frequency(seen, np.minimum(beyond, LARGEST_EXTRA_SPEED))
        actions[:, 3] = block
        actions[:, 4] = -self.gains.roll * seen.roll
        return np.asarray(np.clip(actions, -1.0, 1.0), np.float32)

    def _block_displacement(self, seen: Seen) -> FloatArray:
        return self._for_pitch(self._wanted_pitch(seen), seen) + self._for_depth(seen)

    def _wanted_pitch(self, seen: Seen) -> FloatArray:
        gains = self.gains
        climb = np.clip(gains.depth * seen.depth_error, -gains.climb_limit, gains.climb_limit)
        climb = climb + seen.goal_depth_rate - gains.climb_damping * seen.depth_rate
        # Down is positive and so is the nose up.
        return -np.clip(climb / np.maximum(seen.surge, SLOWEST_SURGE), -0.5, 0.5)

    def _for_pitch(self, pitch: FloatArray, seen: Seen) -> FloatArray:
        gains = self.gains
        action = gains.pitch * pitch + gains.pitch_error * (pitch - seen.pitch)
        return np.asarray(action - gains.pitch_rate * seen.pitch_rate)

    def _for_depth(self, seen: Seen) -> FloatArray:
        gains = self.gains
        self._depth = _integrated(
            self._depth,
            -gains.depth_integral * seen.depth_error * self.period_s,
            np.abs(seen.depth_error) < DEPTH_WINDOW,
            gains.depth_windup,
        )
        return self._depth

    def _tail_offset(self, seen: Seen) -> FloatArray:
        gains = self.gains
        self._heading = _integrated(
            self._heading,
            gains.heading_integral * seen.heading_error * self.period_s,
            np.abs(seen.heading_error) < HEADING_WINDOW,
            HEADING_WINDUP,
        )
        turn = gains.heading * seen.heading_error - gains.heading_rate * seen.yaw_rate
        turn = turn + gains.heading_feedforward * seen.goal_heading_rate + self._heading
        return np.asarray(-turn)

    def _tail_frequency(self, seen: Seen, extra: FloatArray) -> FloatArray:
        gains = self.gains
        rest = (seen.goal_speed <= 0.0) & (seen.speed_error <= 0.0)
        goal, error = (np.where(rest, 0.0, x + extra) for x in (seen.goal_speed, seen.speed_error))
        step = gains.speed_integral * error * self.period_s
        grows = ~rest & (np.abs(error) < self.speed_window)
        self._speed = _integrated(self._speed, step, grows, SPEED_WINDUP)
        action = (gains.frequency + 1.0) * goal / 0.1 - 1.0 + gains.speed * error + self._speed
        return np.where(rest, -1.0, action)


def _integrated(value: FloatArray, step: FloatArray, grows: BoolArray, windup: Gain) -> FloatArray:
    return np.where(grows, np.clip(value + step, -windup, windup), value)
