"""What stands still around the fish: the grid of the tank, its walls, specks in the water."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.rendering.canvas import Canvas
from fish_env.rendering.scene import Tank
from fish_env.rendering.water import SAND

Span = tuple[float, float]
GRID_M = 0.25
REACH_M = 5.0
PIECE_M = 0.5
FAINTEST = 0.06
"""Lines of whose colour less than this is left are not drawn."""
LINE, WALL = np.array([96.0, 104.0, 96.0]), np.array([170.0, 214.0, 220.0])
SPECKS, CLOUD_M = 170, 2.4


class Lines(NamedTuple):
    """Lines that stand still in the water.

    Attributes:
        first: (n, 3) where they begin (m).
        last: (n, 3) where they end (m).
        colours: (n, 4) with how much of the colour is left, 0 to 1.
        widths: (n,) (m).
    """

    first: FloatArray
    last: FloatArray
    colours: FloatArray
    widths: FloatArray


def draw_floor_grid(canvas: Canvas, tank: Tank) -> None:
    """Lines every 25 cm, stronger each metre, inside the walls or as far as one sees."""
    _draw(canvas, _floor_grid(*_extent(canvas, tank), tank.bottom), 0.78 * SAND)


@lru_cache(maxsize=8)
def _floor_grid(north: Span, east: Span, bottom: float) -> Lines:
    """The grid in short pieces, kept until the eye has moved on by one of them."""
    starts, ends, strong = [], [], []
    for axis, (low, high) in enumerate((north, east)):
        other = (east, north)[axis]
        for value in np.arange(np.ceil(low / GRID_M), np.floor(high / GRID_M) + 1) * GRID_M:
            line = _pieces(axis, float(value), other, bottom)
            starts.append(line[:-1])
            ends.append(line[1:])
            strong += [abs(value - round(value)) < 1e-9] * (len(line) - 1)
    return _lines(starts, ends, LINE, np.where(strong, 0.8, 0.45), np.where(strong, 0.004, 0.002))


def draw_walls(canvas: Canvas, tank: Tank) -> None:
    """Level lines every 25 cm and upright ones every half metre on the walls, if there are any."""
    if tank.walls is not None:
        _draw(canvas, _wall_lines(tank.top, tank.bottom, tank.walls))


@lru_cache(maxsize=8)
def _wall_lines(top: float, bottom: float, walls: tuple[float, float, float, float]) -> Lines:
    north, east = walls[:2], walls[2:]
    depths = np.linspace(top, bottom, max(2, round((bottom - top) / GRID_M) + 1))
    starts, ends = [], []
    for axis, sides in enumerate((north, east)):
        along = (east, north)[axis]
        for side in sides:
            for depth in depths:
                line = _pieces(axis, side, along, float(depth))
                starts.append(line[:-1])
                ends.append(line[1:])
            upper = _pieces(axis, side, along, top)
            starts.append(upper)
            ends.append(upper + np.array([0.0, 0.0, bottom - top]))
    return _lines(starts, ends, WALL, 0.5, 0.003)


def _lines(
    starts: list[FloatArray],
    ends: list[FloatArray],
    colour: FloatArray,
    opacity: npt.ArrayLike,
    widths: npt.ArrayLike,
) -> Lines:
    first, last = np.concatenate(starts), np.concatenate(ends)
    left, wide = (np.broadcast_to(np.asarray(v, float), len(first)) for v in (opacity, widths))
    colours = np.column_stack([np.tile(colour, (len(first), 1)), left])
    return Lines(first, last, colours, wide)


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


def _draw(canvas: Canvas, lines: Lines, ground: npt.ArrayLike | None = None) -> None:
    """Lines over what is painted, so faint that they need no layer of their own."""
    canvas.lines(*lines, ground, FAINTEST)


@cache
def _cloud() -> FloatArray:
    return np.random.default_rng(11).uniform(-CLOUD_M, CLOUD_M, (SPECKS, 3))


def draw_specks(canvas: Canvas, centre: FloatArray, tank: Tank) -> None:
    """Specks that stand in the water and show that the fish moves."""
    points = (_cloud() - centre + CLOUD_M) % (2.0 * CLOUD_M) - CLOUD_M + centre
    points = points[(points[:, 2] > tank.top + 0.02) & (points[:, 2] < tank.bottom - 0.02)]
    colours = np.tile([214.0, 240.0, 240.0, 0.55], (len(points), 1))
    canvas.discs(points, np.full(len(points), 0.0016), colours)
