"""Path: a helix, legs between waypoints, or a figure of eight, that begins where the fish is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.envs.config import EnvConfig
from fish_env.envs.layout import GoalKind
from fish_env.envs.tasks.hold import between, hold_goal

SHAPES = ("helix", "waypoints", "figure")
DRAWN_LEGS = 4
DRAWS_PER_LEG = 3
FIRST_DRAW = 4
WALL_MARGIN = 0.4
"""Least distance of a waypoint from a wall (m): about the smallest radius a fish turns on."""
WAYS_ROUND = 8
"""Directions that are tried for a leg that would end beyond a wall."""


def path_goal(config: EnvConfig, draws: FloatArray) -> dict[str, FloatArray]:
    """One path: its shape is drawn by ``goal.path.share``, its size from the shape's ranges.

    A helix goes down or up at a constant rate for some turns, and then round at its last depth. A
    figure goes round on a circle while its depth swings twice in a turn: seen from the side it is
    a figure of eight. A fish cannot loop the loop: it tumbles, and can climb by a quarter at most.

    Args:
        config: settings; ``goal`` and the tank are used.
        draws: (GOAL_DRAWS, N) uniform in [0, 1).

    Returns:
        Goal field -> (N,), SI; see layout.GOAL and layout.WAYPOINTS.
    """
    settings = config.tree["goal"]["path"]
    share = np.array([settings["share"][shape] for shape in SHAPES])
    ends = np.cumsum(share) / share.sum()
    shape = np.minimum(np.searchsorted(ends, draws[3], side="right"), len(SHAPES) - 1)
    common = hold_goal(config, draws)
    makers = (_helix, _waypoints, _figure)
    made = [common | maker(config, common, draws) for maker in makers]
    fields = dict.fromkeys(name for goals in made for name in goals)
    zero = np.zeros(draws.shape[1])
    return {
        name: np.choose(
            shape, [np.broadcast_to(goals.get(name, zero), zero.shape) for goals in made]
        )
        for name in fields
    }


def _circle(draws: FloatArray, radius: FloatArray) -> dict[str, FloatArray]:
    """What helix and figure share: the kind, and a radius to starboard or to port."""
    side = np.where(draws[4] < 0.5, -1.0, 1.0)
    return {"kind": np.full(len(side), float(GoalKind.CIRCLE)), "path_radius": side * radius}


def _helix(
    config: EnvConfig, common: Mapping[str, FloatArray], draws: FloatArray
) -> dict[str, FloatArray]:
    settings, (low, high) = config.tree["goal"]["path"]["helix"], config.tree["goal"]["depth"]
    radius, turns = between(settings["radius"], draws[5]), between(settings["turns"], draws[6])
    # The whole way stays within the range of goal depths.
    way = np.minimum(turns * between(settings["pitch"], draws[7]), high - low)
    down = np.where(draws[8] < 0.5, -1.0, 1.0)
    top = low + (high - low - way) * draws[0]
    return _circle(draws, radius) | {
        "depth_base": np.where(down > 0, top, top + way),
        "path_pitch": down * way / turns,
        "path_length": turns * 2.0 * np.pi * radius,
    }


def _figure(
    config: EnvConfig, common: Mapping[str, FloatArray], draws: FloatArray
) -> dict[str, FloatArray]:
    settings, (low, high) = config.tree["goal"]["path"]["figure"], config.tree["goal"]["depth"]
    radius = between(settings["radius"], draws[5])
    swing = np.minimum(between(settings["swing"], draws[6]), (high - low) / 2.0)
    first = np.where(draws[7] < 0.5, -1.0, 1.0)
    return _circle(draws, radius) | {
        "depth_base": low + swing + (high - low - 2.0 * swing) * draws[0],
        "path_swing": first * swing,
        "path_length": 2.0 * np.pi * radius,
    }


def _waypoints(
    config: EnvConfig, common: Mapping[str, FloatArray], draws: FloatArray
) -> dict[str, FloatArray]:
    """Legs that turn to either side and go up and down, inside the tank."""
    settings, (low, high) = config.tree["goal"]["path"]["waypoints"], config.tree["goal"]["depth"]
    course, depth = common["heading_base"], common["depth_base"]
    north, east = np.zeros_like(course), np.zeros_like(course)
    goals: dict[str, FloatArray] = {}
    for leg in range(DRAWN_LEGS):
        first = FIRST_DRAW + DRAWS_PER_LEG * leg
        size, bend, slope = draws[first : first + DRAWS_PER_LEG]
        length = between(settings["leg"], size)
        turn = between(settings["turn"], np.abs(2.0 * bend - 1.0))
        turn = np.where(bend < 0.5, -turn, turn) if leg else np.zeros_like(turn)
        course = _inside(config, north, east, length, course, turn)
        north, east = north + length * np.cos(course), east + length * np.sin(course)
        step = between(settings["slope"], np.abs(2.0 * slope - 1.0)) * length
        wanted = depth + np.where(slope < 0.5, -step, step)
        turned = np.where((wanted < low) | (wanted > high), 2.0 * depth - wanted, wanted)
        depth = np.clip(turned, low, high)
        if leg == 0:
            goals["heading_base"] = course
        goals |= {
            f"waypoint_{leg + 1}_north": north,
            f"waypoint_{leg + 1}_east": east,
            f"waypoint_{leg + 1}_depth": depth - common["depth_base"],
        }
    return goals | {
        "kind": np.full(len(course), float(GoalKind.LEGS)),
        "path_points": np.full(len(course), DRAWN_LEGS + 1.0),
    }


def _inside(
    config: EnvConfig,
    north: FloatArray,
    east: FloatArray,
    length: FloatArray,
    course: FloatArray,
    turn: FloatArray,
) -> FloatArray:
    """Courses (N,) of legs that end inside the walls: as drawn, else the first that does."""
    walls: Any = config.tree["tank"]["walls"]
    if walls is None:
        return np.asarray(course + turn)
    steps = np.arange(WAYS_ROUND)[:, None] * (2.0 * np.pi / WAYS_ROUND)
    ways = course + np.where(turn < 0, turn - steps, turn + steps)
    room = _room(walls, north + length * np.cos(ways), east + length * np.sin(ways))
    fits: BoolArray = room >= WALL_MARGIN
    best = np.where(fits.any(axis=0), fits.argmax(axis=0), room.argmax(axis=0))
    return np.asarray(ways[best, np.arange(len(course))])


def _room(walls: list[float], north: FloatArray, east: FloatArray) -> FloatArray:
    """Distance to the nearest wall (m), negative beyond it."""
    sides = [north - walls[0], walls[1] - north, east - walls[2], walls[3] - east]
    return np.asarray(np.minimum.reduce(sides))
