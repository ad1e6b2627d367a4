"""The path or place of a fish as points, for pictures."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.batch import FishBatch
from fish_env.envs.layout import GOAL, WAYPOINTS, GoalKind, Setup
from fish_env.envs.plain_guidance import corner, leg_of

NOTHING = np.zeros((0, 3))
SPACING = 0.05
"""Distance of points along a path (m), about."""


def outline(batch: FishBatch, lane: int) -> FloatArray:
    """The path (n, 3) of a fish, or a ring around its place: north, east, depth (m)."""
    rows, data = batch._rows, batch._data[:, lane]
    goal = dict(zip(GOAL, data[rows.ROW_GOAL :], strict=False))
    setup = batch._setup
    kind = GoalKind(int(goal["kind"]))
    if kind is GoalKind.CIRCLE:
        return _circle(goal)
    if kind is GoalKind.LEGS:
        count = int(goal["path_points"])
        offsets = data[rows.ROW_POINTS : rows.ROW_POINTS + len(WAYPOINTS)].reshape(-1, 3)
        points = np.vstack([np.zeros(3), offsets[: count - 1]]) + _start(goal)
        return _legs(points, float(setup[Setup.CORNER]))
    if kind is GoalKind.PLACE:
        return _ring(_start(goal), float(setup[Setup.TOLERANCE_PLACE]))
    return NOTHING


def _start(goal: dict[str, float]) -> FloatArray:
    return np.array([goal["place_north"], goal["place_east"], goal["depth_base"]])


def _ring(middle: FloatArray, radius: float) -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    return np.asarray(middle + radius * ring)


def _circle(goal: dict[str, float]) -> FloatArray:
    radius, length = goal["path_radius"], goal["path_length"]
    along = np.linspace(0.0, length, max(2, round(length / SPACING)))
    first = goal["heading_base"]
    course = first + along / radius
    turns = along / (2.0 * np.pi * abs(radius))
    depth = goal["path_pitch"] * turns + goal["path_swing"] * np.sin(4.0 * np.pi * turns)
    north = radius * (np.sin(course) - np.sin(first))
    east = radius * (np.cos(first) - np.cos(course))
    return np.asarray(_start(goal) + np.stack([north, east, depth], axis=1))


def _legs(points: FloatArray, radius: float) -> FloatArray:
    """Legs, with arcs at the waypoints between them."""
    legs = [leg_of(*step[:2]) for step in np.diff(points, axis=0)]
    parts = [points[:1]]
    for k in range(len(legs) - 1):
        (length, course, *_), (after, following, *_) = legs[k : k + 2]
        turn, bend, cut = corner(length, course, after, following, radius)
        begin = points[k + 1] + cut / length * (points[k] - points[k + 1])
        end = points[k + 1] + cut / after * (points[k + 2] - points[k + 1])
        share = np.linspace(0.0, 1.0, max(2, round(bend * abs(turn) / SPACING) + 1))[:, None]
        arc = begin + share * (end - begin)
        if bend > 0.0:
            headings = course + turn * share[:, 0]
            side = np.sign(turn) * bend
            arc[:, 0] = begin[0] + side * (np.sin(headings) - np.sin(course))
            arc[:, 1] = begin[1] + side * (np.cos(course) - np.cos(headings))
        parts += [_filled(parts[-1][-1], begin), arc]
    return np.vstack([*parts, _filled(parts[-1][-1], points[-1])])


def _filled(begin: FloatArray, end: FloatArray) -> FloatArray:
    count = max(1, round(float(np.linalg.norm(end - begin)) / SPACING))
    return np.asarray(begin + np.linspace(0.0, 1.0, count + 1)[1:, None] * (end - begin))
