"""What the keys and the mouse do, over the picture of a window."""

from __future__ import annotations

import pygame

from fish_env.rendering.gauges import INK, panel
from fish_env.rendering.lettering import write
from fish_env.rendering.light import GOAL

KEYS = (
    ("drag, arrows", "turn the camera"),
    ("wheel, + −", "nearer, farther"),
    ("space", "pause, go on"),
    (".", "one step"),
    ("R", "first view"),
    ("H", "this help"),
    ("Esc, Q", "close the window"),
)
ROW, WIDTH = 20, 270


def draw_note(surface: pygame.Surface, text: str) -> None:
    """A few words at the head of the picture, small enough to fit."""
    width = surface.get_width()
    size = 12 if width > 440 else 9
    room = 0.62 * size * len(text) + 16
    panel(surface, (width / 2 - room / 2, 6, room, 2 * size - 2), 7)
    write(surface, text, (width / 2, 5 + size), size, INK, "middle")


def draw_help(surface: pygame.Surface) -> None:
    """The list of keys."""
    width, height = surface.get_size()
    unit = min(1.0, width / (WIDTH + 20), height / (ROW * (len(KEYS) + 1)))
    row, wide = ROW * unit, WIDTH * unit
    x, y = (width - wide) / 2, (height - row * (len(KEYS) + 0.8)) / 2
    panel(surface, (x, y, wide, row * (len(KEYS) + 0.8)), 8)
    for i, (key, what) in enumerate(KEYS):
        middle = y + (i + 0.9) * row
        write(surface, key, (x + 14 * unit, middle), max(8, round(12 * unit)), GOAL)
        write(surface, what, (x + 120 * unit, middle), max(8, round(12 * unit)), INK)
