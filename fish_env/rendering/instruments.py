"""The instruments over the picture: what the fish does in numbers, and what its actuators do."""

from __future__ import annotations

import numpy as np
import pygame

from fish_env.rendering.gauges import DIM, INK, bar, compass, horizon, panel, speed_dial
from fish_env.rendering.lettering import write
from fish_env.rendering.light import FISH, GOAL
from fish_env.rendering.scene import Scene, Setting

ACTUATORS = (
    ("tail offset", "°", 180.0 / np.pi, 0),
    ("tail amplitude", "°", 180.0 / np.pi, 0),
    ("tail frequency", "Hz", 1.0, 1),
    ("block aft", "mm", 1000.0, 1),
    ("block swing", "°", 180.0 / np.pi, 0),
)
"""Name, unit shown, how many of those make one SI unit, and decimals."""
NARROW, TINY = 440, 250
"""Widths (pixels) below which only the gauges, and only a line of numbers, are drawn."""
TOP_SPEED = 0.3
"""m/s at the end of the dial."""


class Instruments:
    """Draws the instruments of one fish."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    def draw(self, surface: pygame.Surface, scene: Scene) -> None:
        """Put on a picture what there is room for."""
        width, height = surface.get_size()
        if width < TINY or height < 0.6 * TINY:
            _draw_line(surface, scene)
            return
        unit = float(np.clip(min(width / 640.0, height / 480.0), 0.62, 3.0))
        _draw_title(surface, scene, unit)
        self._draw_depth(surface, scene, unit)
        _draw_dials(surface, scene, unit)
        if width >= NARROW:
            self._draw_actuators(surface, scene, unit)

    def _draw_depth(self, surface: pygame.Surface, scene: Scene, unit: float) -> None:
        """A scale of the whole depth at the right, with the fish's and the goal's."""
        width, height = surface.get_size()
        x, top = width - 22.0 * unit, 34.0 * unit
        bottom = height - (128.0 if width >= NARROW else 24.0) * unit
        tank = self.setting.tank
        long = bottom - top
        panel(surface, (x - 13 * unit, top - 28 * unit, 30 * unit, long + 38 * unit), 8 * unit)
        write(surface, "depth", (x + 2 * unit, top - 17 * unit), round(9 * unit), DIM, "middle")

        def level(depth: float) -> float:
            share = (depth - tank.top) / (tank.bottom - tank.top)
            return top + long * min(max(share, 0.0), 1.0)

        pygame.draw.line(surface, DIM, (x, top), (x, bottom))
        for depth in _marks(tank.top, tank.bottom):
            pygame.draw.line(surface, DIM, (x, level(depth)), (x + 6 * unit, level(depth)))
        if scene.goal is not None:
            y = level(scene.goal.depth)
            pygame.draw.line(surface, GOAL, (x - 8 * unit, y), (x + 10 * unit, y), round(2 * unit))
        depth = float(scene.position[2])
        _draw_pointer(surface, (x, level(depth)), f"{_number(depth, 2)} m", unit)

    def _draw_actuators(self, surface: pygame.Surface, scene: Scene, unit: float) -> None:
        """Bars of the five actuators over their ranges, at the lower right."""
        width, height = surface.get_size()
        row, inner = 17.0 * unit, 252.0 * unit
        x, y = width - inner - 8 * unit, height - 5 * row - 16 * unit
        panel(surface, (x, y, inner, 5 * row + 10 * unit), 8 * unit)
        limits = zip(self.setting.low, self.setting.high, strict=True)
        rows = zip(ACTUATORS, scene.actuators, limits, strict=True)
        for i, ((name, symbol, factor, decimals), value, (low, high)) in enumerate(rows):
            middle = y + 5 * unit + (i + 0.5) * row
            size = round(10.5 * unit)
            write(surface, name, (x + 8 * unit, middle), size, INK)
            bar_at = (x + 98 * unit, middle - 3.5 * unit, 90 * unit, 7 * unit)
            bar(surface, bar_at, float(value), float(low), float(high))
            number = _number(factor * float(value), decimals)
            write(surface, f"{number} {symbol}", (x + inner - 8 * unit, middle), size, INK, "right")


def _draw_pointer(surface: pygame.Surface, at: tuple[float, float], text: str, unit: float) -> None:
    """A small arrow from the left, and what it says."""
    x, y = at
    panel(surface, (x - 62 * unit, y - 9 * unit, 48 * unit, 18 * unit), 5 * unit)
    back = x - 10 * unit
    pygame.draw.polygon(surface, FISH, [(x, y), (back, y - 5 * unit), (back, y + 5 * unit)])
    write(surface, text, (x - 18 * unit, y), round(10.5 * unit), INK, "right", bold=True)


def _draw_title(surface: pygame.Surface, scene: Scene, unit: float) -> None:
    size = round(12 * unit)
    at = (12 * unit, 16 * unit)
    text = f"{scene.time_s:5.1f} s"
    width = (66 if not scene.label else 80 + 7.4 * len(scene.label)) * unit
    panel(surface, (6 * unit, 5 * unit, width, 22 * unit), 7 * unit)
    write(surface, text, at, size, INK, bold=True)
    if scene.label:
        write(surface, scene.label, (72 * unit, 16 * unit), size, INK)


def _draw_dials(surface: pygame.Surface, scene: Scene, unit: float) -> None:
    """Attitude, heading and speed at the lower left, each with its numbers below."""
    size = 74.0 * unit
    x, y = 8 * unit, surface.get_height() - size - 34 * unit
    panel(surface, (x, y, 3 * size + 32 * unit, size + 28 * unit), 8 * unit)
    roll, pitch, yaw = (float(angle) for angle in scene.euler)
    heading, speed = (scene.goal.heading, scene.goal.speed) if scene.goal else (None, None)
    middle = y + 6 * unit + size / 2
    first, second, third = (x + 8 * unit + size / 2 + i * (size + 8 * unit) for i in range(3))
    horizon(surface, (first, middle), size, roll, pitch)
    compass(surface, (second, middle), size, yaw, heading)
    speed_dial(surface, (third, middle), size, scene.speed, TOP_SPEED, speed)
    degrees = [_number(np.degrees(angle), 0) for angle in (roll, pitch)]
    texts = {
        first: f"r {degrees[0]}° p {degrees[1]}°",
        second: f"heading {np.degrees(yaw) % 360.0:03.0f}°",
        third: f"{_number(scene.speed, 2)} m/s",
    }
    for centre, text in texts.items():
        write(surface, text, (centre, y + size + 17 * unit), round(10.5 * unit), INK, "middle")


def _draw_line(surface: pygame.Surface, scene: Scene) -> None:
    """The least: label, depth and heading in one line at the foot."""
    width, height = surface.get_size()
    numbers = f"{scene.position[2]:.2f} m  {np.degrees(scene.euler[2]) % 360.0:03.0f}°"
    panel(surface, (0, height - 16, width, 16), 0)
    write(surface, scene.label, (4, height - 8), 10, INK)
    write(surface, numbers, (width - 4, height - 8), 10, INK, "right")


def _number(value: float, decimals: int) -> str:
    """A number with a real minus sign and no negative zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")


def _marks(top: float, bottom: float) -> list[float]:
    """Round depths between two, some ten of them (m)."""
    span = bottom - top
    step = 10.0 ** np.floor(np.log10(span)) / (10.0 if span < 3.0 else 2.0)
    marks: list[float] = (
        np.arange(np.ceil(top / step), np.floor(bottom / step) + 1) * step
    ).tolist()
    return marks
