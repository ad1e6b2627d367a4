"""Records the motion of a fish for videos and replay pages."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.rendering import Scene, write_video
from fish_env.replay import Group, motion_from_trajectory, motion_of_goals, write_replay
from fish_env.trajectory import Trajectory

REPLAY_HZ = 50.0
"""Samples a second of a replay: a beat at 2 Hz has 25."""


class Keeper:
    """Records an episode; call it after each step.

    Args:
        fish: the environment below its wrappers.
        scenes: whether to record what a video needs.
    """

    def __init__(self, fish: RoboticFish3DEnv, scenes: bool) -> None:
        self.fish = fish
        self.scenes: list[Scene] = []
        self._keep_scenes = scenes
        self._states: list[list[float]] = []
        self._inputs: list[FloatArray] = []
        self._goals: list[list[float]] = []

    def __call__(self) -> None:
        """Records the present state."""
        self._states.append(list(self.fish.state.values()))
        self._inputs.append(self.fish.actuators)
        scene = self.fish.scene()
        if scene.goal is not None:
            self._goals.append([scene.goal.depth, scene.goal.heading, scene.goal.speed])
        if self._keep_scenes:
            self.scenes.append(scene)

    def trajectory(self) -> Trajectory:
        """Returns the motion, linear between control steps."""
        period = self.fish.options.config.control_period
        known = np.linspace(period, period * len(self._states), len(self._states))
        times = np.arange(known[0], known[-1], 1.0 / REPLAY_HZ)
        names = self.fish.options.model.kernels.state_names
        states = np.array(self._states)
        states[:, names.index("tail_phase")] = np.unwrap(states[:, names.index("tail_phase")])
        return Trajectory(
            times,
            _between(times, known, _one_sign(states, names.index("qw"))),
            names,
            _between(times, known, np.array(self._inputs)),
            self.fish.options.model.fish.name,
            self.fish.options.config.dt,
        )

    def write_video(self, path: Path) -> Path:
        """Writes a video.

        Raises:
            MissingExtraError: what draws it is not installed.
        """
        return write_video(path, self.scenes, self.fish.setting)

    def write_replay(self, path: Path, name: str) -> Path:
        """Writes a page with the swimming fish, and a second fish at its goal."""
        motion = motion_from_trajectory(self.trajectory(), name)
        shown = [motion]
        if len(self._goals) == len(self._states):
            period = self.fish.options.config.control_period
            times = np.linspace(period, period * len(self._goals), len(self._goals))
            goals = dict(zip(("z", "yaw", "speed"), np.array(self._goals).T, strict=True))
            shown.append(motion_of_goals(motion, times, goals))
        groups = [Group(name, tuple(shown))]
        return write_replay(groups, self.fish.options.model.fish, path, f"Replay of {name}")


def _one_sign(states: FloatArray, first: int) -> FloatArray:
    """Returns quaternions without jumps to their negatives, for interpolation."""
    quaternions = states[:, first : first + 4]
    turns = np.sign((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    quaternions[1:] *= np.cumprod(np.where(turns == 0, 1.0, turns))[:, None]
    return states


def _between(times: FloatArray, known: FloatArray, columns: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, known, column) for column in columns.T], axis=1)
