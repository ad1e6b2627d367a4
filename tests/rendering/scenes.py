"""Scenes, and what can be told of a picture, for the tests of rendering."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.model.frames import quaternion_from_euler
from fish_env.params.io import load_fish
from fish_env.rendering import FishShape, Goal, Scene, Setting
from fish_env.rendering.light import GOAL

FISH = load_fish("zheng-2021-a")
SETTING = Setting(FishShape.of(FISH))
LEVEL = (0.0, 0.0, 0.3)
AHEAD = Goal(0.62, 0.3, 0.1)


def scene(euler=LEVEL, **changes: Any) -> Scene:
    """A fish in the middle of the tank with its tail to one side, or what is said instead."""
    plain = Scene(
        5.0,
        np.array([0.4, -0.2, 0.5]),
        quaternion_from_euler(euler),
        0.1,
        0.3,
        actuators=np.array([0.0, 0.3, 2.0, 0.0, 0.0]),
        goal=AHEAD,
        label="test",
    )
    return replace(plain, **changes)


def line_of(count: int) -> np.ndarray:
    """Past positions (count, 3) straight behind the fish of :func:`scene`, 1 cm apart."""
    back = 0.01 * np.arange(count, 0, -1)[:, None]
    return np.array([0.4, -0.2, 0.5]) - back * [np.cos(0.3), np.sin(0.3), 0.0]


def orange(frame: np.ndarray) -> np.ndarray:
    """Where a picture (h, w, 3) shows the paint of the fish: much redder than the water."""
    red, green, blue = (frame[..., i].astype(int) for i in range(3))
    return (red > 130) & (red > green + 30) & (red > blue + 60)


def mint(frame: np.ndarray) -> np.ndarray:
    """Where a picture shows the arrow of the goal."""
    return np.abs(frame.astype(int) - np.array(GOAL)).max(axis=-1) < 40


def changed(first: np.ndarray, second: np.ndarray, by: int = 24) -> np.ndarray:
    """Where two pictures differ visibly."""
    return np.abs(first.astype(int) - second.astype(int)).max(axis=-1) > by
