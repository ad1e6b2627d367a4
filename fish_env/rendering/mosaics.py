"""Several fish side by side in one picture, each with a camera of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pygame

from fish_env.rendering.scene import PICTURE_SIZE, Scene, Setting
from fish_env.rendering.views import Frame, View, as_array

GAP = 2
FRAME = (8, 20, 30)


def layout(count: int, size: tuple[int, int]) -> tuple[int, int]:
    """Columns and rows whose tiles are nearest to 4:3, with the fewest of them empty."""
    best, least = (1, count), np.inf
    for columns in range(1, count + 1):
        rows = -(-count // columns)
        shape = (size[0] / columns) / (size[1] / rows)
        cost = abs(np.log(shape * 3.0 / 4.0)) + 0.3 * (columns * rows - count)
        if cost < least:
            best, least = (columns, rows), float(cost)
    return best


class Mosaic:
    """Draws scenes of several fish into one picture.

    Args:
        setting: of all of them.
        count: how many fish.
        size: width and height of the whole picture (pixels).
    """

    def __init__(self, setting: Setting, count: int, size: tuple[int, int] = PICTURE_SIZE) -> None:
        self.views = [View(setting, size) for _ in range(count)]
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        """Draw pictures of another size from now on."""
        self.size = size
        self.columns, self.rows = layout(len(self.views), size)
        gap = GAP if len(self.views) > 1 else 0
        tile = (
            max(16, (size[0] + gap) // self.columns - gap),
            max(16, (size[1] + gap) // self.rows - gap),
        )
        for view in self.views:
            view.size = tile
        self._step = (tile[0] + gap, tile[1] + gap)

    def frame(self, scenes: Sequence[Scene]) -> Frame:
        """The picture of one scene for each fish: (height, width, 3), uint8."""
        return as_array(self.surface(scenes))

    def surface(self, scenes: Sequence[Scene]) -> pygame.Surface:
        """The picture as a surface of the drawing library."""
        whole = pygame.Surface(self.size)
        whole.fill(FRAME)
        for i, (view, scene) in enumerate(zip(self.views, scenes, strict=True)):
            column, row = i % self.columns, i // self.columns
            whole.blit(view.surface(scene), (column * self._step[0], row * self._step[1]))
        return whole
