"""What is drawn to be read: the goal's depth and heading, the way the fish came, its shadow."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.rendering.canvas import Canvas
from fish_env.rendering.light import GOAL
from fish_env.rendering.scene import Goal, Scene, Tank

PLANE_HALF_M, PLANE_STEP_M = 0.5, 0.125
LONGEST = 400
"""Pieces of the wake that are drawn."""
BUBBLES_M = 0.03
FOAM = np.array([206.0, 240.0, 240.0])
FAINTEST = 0.10


def draw_goal_plane(canvas: Canvas, scene: Scene, goal: Goal) -> None:
    """A level square at the goal's depth around the fish, with a grid that stands still."""
    north, east = scene.position[:2]
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * PLANE_HALF_M + (north, east)
    canvas.sheet(np.column_stack([corners, np.full(4, goal.depth)]), GOAL, 0.14)
    steps = np.arange(-PLANE_HALF_M, PLANE_HALF_M + 1e-9, PLANE_STEP_M)
    ends = []
    for axis in (0, 1):
        middle = scene.position[axis]
        inside = np.round(middle / PLANE_STEP_M) * PLANE_STEP_M + steps
        inside = inside[np.abs(inside - middle) < PLANE_HALF_M]
        values = np.array([middle - PLANE_HALF_M, *inside, middle + PLANE_HALF_M])
        both = np.full((2, len(values), 3), goal.depth)
        both[..., axis] = values
        both[..., 1 - axis] = scene.position[1 - axis] + np.array([[-PLANE_HALF_M], [PLANE_HALF_M]])
        ends.append(both)
    first, last = np.concatenate(ends, axis=1)
    colours = np.tile(0.75 * np.array(GOAL), (len(first), 1))
    canvas.lines(first, last, colours, np.full(len(first), 0.0008))


def draw_goal_heading(canvas: Canvas, scene: Scene, goal: Goal, length: float) -> None:
    """An arrow in the plane of the goal that points where the fish is to head."""
    ahead = np.array([np.cos(goal.heading), np.sin(goal.heading)])
    aside = np.array([-ahead[1], ahead[0]])
    start, neck, tip = 0.62 * length, 1.22 * length, 1.52 * length
    shaft, head = 0.05 * length, 0.15 * length
    outline = [
        (start, -shaft),
        (neck, -shaft),
        (neck, -head),
        (tip, 0.0),
        (neck, head),
        (neck, shaft),
        (start, shaft),
    ]
    flat = scene.position[:2] + np.array([x * ahead + y * aside for x, y in outline])
    points = np.column_stack([flat, np.full(len(flat), goal.depth)])
    canvas.sheet(points, GOAL, 0.95)
    canvas.lines(
        points, np.roll(points, -1, axis=0), np.tile([20.0, 90.0, 70.0], (7, 1)), np.full(7, 0.002)
    )


def draw_plumb_line(canvas: Canvas, scene: Scene, goal: Goal) -> None:
    """Dashes straight from the fish to the plane of its goal."""
    count = int(min(60, abs(goal.depth - scene.position[2]) / 0.02)) // 2 * 2
    if count < 2:
        return
    depths = np.linspace(scene.position[2], goal.depth, count + 1)
    points = np.column_stack([np.tile(scene.position[:2], (count + 1, 1)), depths])
    colours = np.tile([*GOAL, 0.8], (count // 2, 1))
    canvas.lines(points[0:-1:2], points[1::2], colours, np.full(count // 2, 0.003))


def draw_path(canvas: Canvas, scene: Scene) -> None:
    """Dashes along the path that the fish is to swim."""
    first, last = scene.path[0:-1:2], scene.path[1::2]
    if len(last):
        first = first[: len(last)]
        colours = np.tile([*GOAL, 0.8], (len(last), 1))
        canvas.lines(first, last, colours, np.full(len(last), 0.004))


def wake_points(scene: Scene, clear: float) -> FloatArray:
    """(n, 3) the way the fish came (m), but for what is nearer to its middle than ``clear``."""
    past = scene.wake[-LONGEST:]
    return np.asarray(past[np.linalg.norm(past - scene.position, axis=1) > clear])


def draw_wake(canvas: Canvas, points: FloatArray, which: BoolArray) -> None:
    """The way the fish came, a line with bubbles that fade with age; ``which`` (n - 1,) of it."""
    if not which.any():
        return
    share = np.linspace(FAINTEST, 1.0, len(points) - 1)[which]
    first, last = points[:-1][which], points[1:][which]
    colours = np.column_stack([np.tile(FOAM, (len(share), 1)), 0.75 * share])
    canvas.lines(first, last, colours, 0.0012 + 0.0018 * share)
    # Bubbles stand where the way crosses cells of a grid, so that they stay where they are.
    crossing = np.any(np.floor(first / BUBBLES_M) != np.floor(last / BUBBLES_M), axis=1)
    colours[:, 3] = 0.15 + 0.85 * share
    canvas.discs(last[crossing], 0.0015 + 0.0022 * share[crossing], colours[crossing])


def draw_shadow(canvas: Canvas, outline: FloatArray, tank: Tank) -> None:
    """A soft shadow of the fish on the floor; the higher it swims, the larger and fainter.

    Args:
        canvas: what is drawn on.
        outline: (n, 3) points around the fish seen from above, in order (m).
        tank: whose floor.
    """
    height = max(0.0, tank.bottom - float(outline[:, 2].mean()))
    flat = outline.copy()
    flat[:, 2] = tank.bottom
    middle = flat.mean(axis=0)
    sizes = np.linspace(1.0 + 0.9 * height, 0.8, 7)
    outlines = middle + sizes[:, None, None] * (flat - middle)
    canvas.sheets(outlines, (16, 30, 34), 0.13 / (1.0 + 1.2 * height))
