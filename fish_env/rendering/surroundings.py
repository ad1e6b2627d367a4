"""What stands still around the fish: the grid of the tank, its walls, specks in the water."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
import numpy.typing as npt

from fish_env.arrays import BoolArray, FloatArray
from fish_env.rendering.canvas import Canvas
from fish_env.rendering.light import clearness
from fish_env.rendering.scene import Tank
from fish_env.rendering.water import SAND

Span = tuple[float, float]
GRID_M = 0.25
REACH_M = 5.0
PIECE_M = 0.5
LINE, WALL = np.array([96.0, 104.0, 96.0]), np.array([170.0, 214.0, 220.0])
SPECKS, CLOUD_M = 170, 2.4


def draw_floor_grid(canvas: Canvas, tank: Tank) -> None:
    """Lines every 25 cm, stronger each metre, inside the walls or as far as one sees."""
    first, last, strong = _floor_grid(*_extent(canvas, tank), tank.bottom)
    opacity, widths = np.where(strong, 0.8, 0.45), np.where(strong, 0.004, 0.002)
    _draw(canvas, first, last, LINE, opacity, widths, 0.78 * SAND)


@lru_cache(maxsize=8)
def _floor_grid(north: Span, east: Span, bottom: float) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Both ends (n, 3) of the lines, in short pieces, and which (n,) lie at whole metres."""
    starts, ends, strong = [], [], []
    for axis, (low, high) in enumerate((north, east)):
        other = (east, north)[axis]
        for value in np.arange(np.ceil(low / GRID_M), np.floor(high / GRID_M) + 1) * GRID_M:
            line = _pieces(axis, float(value), other, bottom)
            starts.append(line[:-1])
            ends.append(line[1:])
            strong += [abs(value - round(value)) < 1e-9] * (len(line) - 1)
    return np.concatenate(starts), np.concatenate(ends), np.array(strong)


def draw_walls(canvas: Canvas, tank: Tank) -> None:
    """Level lines every 25 cm and upright ones every half metre on the walls, if there are any."""
    if tank.walls is None:
        return
    north, east = tank.walls[:2], tank.walls[2:]
    depths = np.linspace(
        tank.top, tank.bottom, max(2, round((tank.bottom - tank.top) / GRID_M) + 1)
    )
    starts, ends = [], []
    for axis, sides in enumerate((north, east)):
        along = (east, north)[axis]
        for side in sides:
            for depth in depths:
                line = _pieces(axis, side, along, float(depth))
                starts.append(line[:-1])
                ends.append(line[1:])
            upper = _pieces(axis, side, along, tank.top)
            starts.append(upper)
            ends.append(upper + np.array([0.0, 0.0, tank.bottom - tank.top]))
    first, last = np.concatenate(starts), np.concatenate(ends)
    _draw(canvas, first, last, WALL, np.full(len(first), 0.5), np.full(len(first), 0.003))


def _extent(canvas: Canvas, tank: Tank) -> tuple[Span, Span]:
    if tank.walls is not None:
        return tank.walls[:2], tank.walls[2:]
    north, east = (float(np.round(x / PIECE_M) * PIECE_M) for x in canvas.camera.eye[:2])
    return (north - REACH_M, north + REACH_M), (east - REACH_M, east + REACH_M)


def _pieces(axis: int, value: float, other: Span, depth: float) -> FloatArray:
    """A level line in short pieces, so that haze can change along it: points (n, 3)."""
    count = max(2, round((other[1] - other[0]) / PIECE_M) + 1)
    points = np.full((count, 3), depth)
    points[:, axis] = value
    points[:, 1 - axis] = np.linspace(*other, count)
    return points


def _draw(
    canvas: Canvas,
    first: FloatArray,
    last: FloatArray,
    colour: FloatArray,
    opacity: FloatArray,
    widths: FloatArray,
    ground: npt.ArrayLike | None = None,
) -> None:
    """Lines over what is painted, so faint that they need no layer of their own."""
    near = canvas.camera.seen(0.5 * (first + last))[:, 0]
    kept = (near > -PIECE_M) & (opacity * clearness(np.abs(near)) > 0.06)
    colours = np.column_stack([np.tile(colour, (len(first), 1)), opacity])[kept]
    canvas.lines(first[kept], last[kept], colours, widths[kept], ground)


@cache
def _cloud() -> FloatArray:
    return np.random.default_rng(11).uniform(-CLOUD_M, CLOUD_M, (SPECKS, 3))


def draw_specks(canvas: Canvas, centre: FloatArray, tank: Tank) -> None:
    """Specks that stand in the water and show that the fish moves."""
    points = (_cloud() - centre + CLOUD_M) % (2.0 * CLOUD_M) - CLOUD_M + centre
    points = points[(points[:, 2] > tank.top + 0.02) & (points[:, 2] < tank.bottom - 0.02)]
    colours = np.tile([214.0, 240.0, 240.0, 0.55], (len(points), 1))
    canvas.discs(points, np.full(len(points), 0.0016), colours)
