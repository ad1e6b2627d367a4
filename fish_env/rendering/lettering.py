"""Letters for the instruments, drawn once and kept."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
import pygame

Colour = tuple[int, int, int]


@lru_cache(maxsize=32)
def font(size: int, bold: bool = False) -> pygame.font.Font:
    """DejaVu Sans, which comes with matplotlib and so looks the same on every machine."""
    pygame.font.init()
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
    # Some distributions take the fonts out of matplotlib; then the library's own has to do.
    return pygame.font.Font(str(file) if file.is_file() else None, size)


@lru_cache(maxsize=512)
def words(text: str, size: int, colour: Colour, bold: bool = False) -> pygame.Surface:
    """Text as a picture; the same words are drawn once."""
    try:
        return font(size, bold).render(text, True, colour)
    except pygame.error:
        # Another program part has called pygame.quit, which ends all fonts of the process.
        font.cache_clear()
        return font(size, bold).render(text, True, colour)


def write(
    surface: pygame.Surface,
    text: str,
    at: tuple[float, float],
    size: int,
    colour: Colour,
    align: str = "left",
    bold: bool = False,
) -> None:
    """Text with its middle at a height, and its left end, middle or right end at x."""
    picture = words(text, size, colour, bold)
    shift = {"left": 0.0, "middle": 0.5, "right": 1.0}[align]
    x = at[0] - shift * picture.get_width()
    surface.blit(picture, (round(x), round(at[1] - 0.5 * picture.get_height())))
