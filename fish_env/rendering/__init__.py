"""Pictures, windows and videos of a swimming fish.

What is drawn is a :class:`Scene` in a :class:`Setting`, wherever they come from. Drawing needs the
extra ``render``; pygame is imported only when something is drawn.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fish_env.errors import MissingExtraError, missing_extra
from fish_env.rendering.scene import PICTURE_SIZE, Goal, Scene, Setting, Tank, between
from fish_env.rendering.shape import FishShape
from fish_env.rendering.trajectory import scenes_of

if TYPE_CHECKING:
    from fish_env.rendering.mosaics import Mosaic
    from fish_env.rendering.views import View
    from fish_env.rendering.windows import Window

__all__ = [
    "FishShape",
    "Goal",
    "Scene",
    "Setting",
    "Tank",
    "between",
    "check_installed",
    "mosaic",
    "scenes_of",
    "view",
    "window",
    "write_video",
]


def check_installed() -> None:
    """Say what to install if pictures cannot be drawn.

    Raises:
        MissingExtraError: pygame-ce is not installed.
    """
    try:
        # The library greets on stdout unless told not to.
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        import pygame
    except ImportError:
        raise missing_extra("Drawing the fish", "pygame-ce", "render") from None
    if not getattr(pygame, "IS_CE", False):
        raise MissingExtraError(
            "Drawing the fish needs 'pygame-ce', but 'pygame' is installed instead. "
            "Replace it with: pip uninstall pygame; pip install --force-reinstall pygame-ce"
        )


def view(setting: Setting, size: tuple[int, int] = PICTURE_SIZE) -> View:
    """What draws scenes of one fish as arrays (height, width, 3), uint8.

    Raises:
        MissingExtraError: pygame is not installed.
    """
    check_installed()
    from fish_env.rendering.views import View

    return View(setting, size)


def mosaic(setting: Setting, count: int, size: tuple[int, int] = PICTURE_SIZE) -> Mosaic:
    """What draws scenes of several fish side by side as one array.

    Raises:
        MissingExtraError: pygame is not installed.
    """
    check_installed()
    from fish_env.rendering.mosaics import Mosaic

    return Mosaic(setting, count, size)


def window(setting: Setting, count: int = 1, size: tuple[int, int] = PICTURE_SIZE) -> Window:
    """A window that shows one fish, or several side by side.

    Raises:
        MissingExtraError: pygame is not installed.
        ConfigError: there is no screen.
    """
    check_installed()
    from fish_env.rendering.windows import Window

    return Window(setting, count, size)


def write_video(
    path: str | Path,
    scenes: Sequence[Scene],
    setting: Setting,
    *,
    fps: float = 30.0,
    size: tuple[int, int] = PICTURE_SIZE,
    report: Callable[[], object] = lambda: None,
) -> Path:
    """Write scenes as a film (mp4, H.264) that runs in real time.

    Args:
        path: file to write; its folder is made.
        scenes: in the order of their times; what lies between is filled in.
        setting: the fish's shape and its tank.
        fps: frames a second.
        size: width and height (pixels), even numbers.
        report: called after each frame.

    Raises:
        ConfigError: fewer than two scenes, times that do not increase, or an odd size.
        MissingExtraError: pygame or imageio-ffmpeg is not installed.
    """
    check_installed()
    from fish_env.rendering.video import write

    return write(Path(path), scenes, setting, fps, size, report)
