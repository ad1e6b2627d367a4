"""Single instruments: a horizon, a compass, a speed dial, a depth scale, a bar."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pygame

from fish_env.rendering.lettering import Colour, write
from fish_env.rendering.light import FISH, GOAL

PANEL = (6, 24, 38, 150)
INK: Colour = (228, 240, 244)
DIM: Colour = (128, 160, 174)
SKY: Colour = (70, 140, 176)
GROUND: Colour = (112, 92, 62)
FACE = (10, 34, 52, 235)
SWEEP = np.radians(135.0)
"""From the top of the speed dial to both of its ends."""
FINE = 3
"""Gauges are drawn this much larger and shrunk, so that their edges come out smooth."""


def panel(surface: pygame.Surface, rect: tuple[float, float, float, float], radius: float) -> None:
    """A dark, half transparent plate to read things on."""
    x, y, width, height = (round(v) for v in rect)
    surface.blit(_plate(width, height, round(radius)), (x, y))


@lru_cache(maxsize=32)
def _plate(width: int, height: int, radius: int) -> pygame.Surface:
    plate = pygame.Surface((FINE * width, FINE * height), pygame.SRCALPHA)
    pygame.draw.rect(plate, PANEL, plate.get_rect(), border_radius=FINE * radius)
    return pygame.transform.smoothscale(plate, (width, height))


@lru_cache(maxsize=8)
def _mask(size: int) -> pygame.Surface:
    """White inside a circle, clear outside, to cut a square down to it."""
    disc = pygame.Surface((size, size), pygame.SRCALPHA)
    pygame.draw.circle(disc, (255, 255, 255, 255), (size / 2, size / 2), size / 2 - 1)
    return disc


def _on_circle(middle: float, radius: float, angle: float) -> tuple[float, float]:
    """A point at an angle clockwise from the top."""
    return middle + radius * np.sin(angle), middle - radius * np.cos(angle)


def _shrunk(
    surface: pygame.Surface, large: pygame.Surface, at: tuple[float, float], size: float
) -> None:
    small = pygame.transform.smoothscale(large, (round(size), round(size)))
    surface.blit(small, (round(at[0] - size / 2), round(at[1] - size / 2)))


def horizon(
    surface: pygame.Surface, at: tuple[float, float], size: float, roll: float, pitch: float
) -> None:
    """Attitude: the horizon as seen from the fish, 45 degrees of pitch to the rim (rad)."""
    full = round(FINE * size)
    middle = full / 2
    dial = pygame.Surface((full, full), pygame.SRCALPHA)
    dial.fill(SKY)
    _draw_ground(dial, roll, pitch)
    for side in (-1, 1):
        inner, outer = middle + side * 0.10 * full, middle + side * 0.26 * full
        pygame.draw.line(dial, FISH, (inner, middle), (outer, middle), 3 * FINE)
    pygame.draw.circle(dial, FISH, (middle, middle), 1.6 * FINE)
    dial.blit(_mask(full), (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
    pygame.draw.circle(dial, DIM, (middle, middle), middle - 1, 2 * FINE - 2)
    _shrunk(surface, dial, at, size)


def _draw_ground(dial: pygame.Surface, roll: float, pitch: float) -> None:
    """What is below the horizon, and lines at each ten degrees of pitch."""
    full = dial.get_width()
    reach = full / 2
    # Plain numbers: numpy takes longer for so few.
    cosine, sine = float(np.cos(roll)), float(np.sin(roll))
    per_radian = float(np.radians(45.0))
    centre = reach + sine * reach * pitch / per_radian, reach + cosine * reach * pitch / per_radian
    x, y = 3 * full * cosine, -3 * full * sine
    left, right = (centre[0] - x, centre[1] - y), (centre[0] + x, centre[1] + y)
    x, y = 6 * full * sine, 6 * full * cosine
    corners = [left, right, (right[0] + x, right[1] + y), (left[0] + x, left[1] + y)]
    pygame.draw.polygon(dial, GROUND, corners)
    for degrees in (-30, -20, -10, 0, 10, 20, 30):
        middle = (
            centre[0] - sine * reach * degrees / 45.0,
            centre[1] - cosine * reach * degrees / 45.0,
        )
        half = reach * (0.9 if degrees == 0 else 0.22 if degrees % 20 else 0.34)
        x, y = half * cosine, half * -sine
        ends = (middle[0] - x, middle[1] - y), (middle[0] + x, middle[1] + y)
        pygame.draw.line(dial, INK, *ends, FINE if degrees else FINE + 1)


def _face(full: int) -> pygame.Surface:
    """A round dial with nothing on it."""
    dial = pygame.Surface((full, full), pygame.SRCALPHA)
    middle = full / 2
    pygame.draw.circle(dial, FACE, (middle, middle), middle - 1)
    pygame.draw.circle(dial, DIM, (middle, middle), middle - 1, 2 * FINE - 2)
    return dial


def _mark_goal(dial: pygame.Surface, angle: float) -> None:
    """A mark on the rim of a dial that points inwards."""
    middle = dial.get_width() / 2
    corners = ((0.74, 0.0), (0.99, -0.19), (0.99, 0.19))
    points = [_on_circle(middle, radius * middle, angle + turn) for radius, turn in corners]
    pygame.draw.polygon(dial, GOAL, points)


@lru_cache(maxsize=8)
def _rose(full: int) -> pygame.Surface:
    dial = _face(full)
    middle = full / 2
    for step in range(24):
        angle = np.radians(15.0 * step)
        inner = middle * (0.80 if step % 2 == 0 else 0.87)
        ends = _on_circle(middle, inner, angle), _on_circle(middle, 0.94 * middle, angle)
        pygame.draw.line(dial, DIM if step % 6 else INK, *ends, FINE)
    for letter, angle in zip("NESW", np.arange(4) * np.pi / 2, strict=True):
        x, y = _on_circle(middle, 0.60 * middle, angle)
        write(dial, letter, (x, y), round(0.15 * full), INK, "middle", bold=True)
    return dial


def compass(
    surface: pygame.Surface,
    at: tuple[float, float],
    size: float,
    heading: float,
    goal: float | None,
) -> None:
    """Heading over ground, north up, with the goal's heading on the rim (rad)."""
    full = round(FINE * size)
    middle = full / 2
    dial = _rose(full).copy()
    if goal is not None:
        _mark_goal(dial, goal)
    points = ((0.70, 0.0), (0.22, 2.5), (0.10, np.pi), (0.22, -2.5))
    needle = [_on_circle(middle, radius * middle, heading + turn) for radius, turn in points]
    pygame.draw.polygon(dial, FISH, needle)
    _shrunk(surface, dial, at, size)


@lru_cache(maxsize=8)
def _speed_face(full: int) -> pygame.Surface:
    dial = _face(full)
    middle = full / 2
    for step in range(11):
        angle = -SWEEP + 2.0 * SWEEP * step / 10
        inner = middle * (0.78 if step % 5 == 0 else 0.86)
        ends = _on_circle(middle, inner, angle), _on_circle(middle, 0.93 * middle, angle)
        pygame.draw.line(dial, INK if step % 5 == 0 else DIM, *ends, FINE)
    return dial


def speed_dial(
    surface: pygame.Surface,
    at: tuple[float, float],
    size: float,
    speed: float,
    top: float,
    goal: float | None,
) -> None:
    """Surge speed (m/s) on a dial that ends at ``top``, with the goal's speed on the rim."""
    full = round(FINE * size)
    middle = full / 2
    dial = _speed_face(full).copy()

    def angle(value: float) -> float:
        return float(-SWEEP + 2.0 * SWEEP * min(max(value / top, 0.0), 1.0))

    if goal is not None:
        _mark_goal(dial, angle(goal))
    ends = (middle, middle), _on_circle(middle, 0.72 * middle, angle(speed))
    pygame.draw.line(dial, FISH, *ends, 3 * FINE)
    pygame.draw.circle(dial, FISH, (middle, middle), 3 * FINE)
    _shrunk(surface, dial, at, size)


def bar(
    surface: pygame.Surface,
    rect: tuple[float, float, float, float],
    value: float,
    low: float,
    high: float,
) -> None:
    """A value between its least and largest, filled from zero."""
    x, y, width, height = rect
    span = high - low if high > low else 1.0
    zero, end = (min(max((v - low) / span, 0.0), 1.0) for v in (0.0, value))
    pygame.draw.rect(surface, (32, 62, 80), (x, y, width, height), border_radius=round(height / 2))
    left, right = x + width * min(zero, end), x + width * max(zero, end)
    pygame.draw.rect(
        surface, FISH, (left, y, max(2.0, right - left), height), border_radius=round(height / 3)
    )
    mark = x + width * zero
    pygame.draw.line(surface, INK, (mark, y - 2), (mark, y + height + 1))
