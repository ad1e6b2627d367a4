"""A window that shows swimming fish in real time, with a camera to move."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

import pygame

from fish_env.errors import ConfigError
from fish_env.rendering.mosaics import Mosaic
from fish_env.rendering.notes import draw_help, draw_note
from fish_env.rendering.scene import PICTURE_SIZE, Scene, Setting, between

TITLE = "robotic fish"
SMALLEST = (160, 120)
FRAMES_S = 30
"""Frames a second, where the machine can; scenes that come slower are filled in."""
UNSEEN = ("offscreen", "dummy")
"""Drivers of the library that show nothing."""
NOTE_S = 5.0
"""For how long a new window says that there is help."""
LONGEST_S = 1.0
"""Scenes further apart are shown one after the other."""
TURN, ZOOM = 0.008, 0.9
"""Radians for a pixel dragged, distance for a click of the wheel."""
KEY_TURN = 0.12
TURNS = {
    pygame.K_LEFT: (-KEY_TURN, 0.0),
    pygame.K_RIGHT: (KEY_TURN, 0.0),
    pygame.K_UP: (0.0, KEY_TURN),
    pygame.K_DOWN: (0.0, -KEY_TURN),
}
ZOOMS = {pygame.K_PLUS: ZOOM, pygame.K_EQUALS: ZOOM, pygame.K_KP_PLUS: ZOOM}
ZOOMS |= {pygame.K_MINUS: 1 / ZOOM, pygame.K_KP_MINUS: 1 / ZOOM}

_open: dict[int, Window] = {}
"""Windows of this process by their number: there is one queue of events for all of them."""


class Window:
    """Shows scenes as they come; each takes as long as it lasted.

    Args:
        setting: of all fish.
        count: how many fish are shown side by side.
        size: width and height at the start (pixels); the window can be resized.

    Attributes:
        paused: whether it stands still until the space bar is pressed.

    Raises:
        ConfigError: no window can be opened, for want of a screen.
    """

    def __init__(
        self, setting: Setting, count: int = 1, size: tuple[int, int] = PICTURE_SIZE
    ) -> None:
        self._window: pygame.Window | None = None
        self._lost = False
        self._make(size)
        self._mosaic = Mosaic(setting, count, size)
        self._last: Sequence[Scene] | None = None
        self._due = 0.0
        self._clock = pygame.time.Clock()
        self._helped = False
        self._stepping = False
        self._noted_until = time.monotonic() + NOTE_S
        self.paused = False

    def _make(self, size: tuple[int, int]) -> None:
        _find_screen()
        self._window = pygame.Window(TITLE, size, resizable=True)
        self._window.minimum_size = SMALLEST
        self._lost = False
        self._number = self._window.id
        _open[self._number] = self
        # Other environments call pygame.quit when they close, which takes this window along.
        pygame.register_quit(self._lose)

    def _lose(self) -> None:
        if _open.pop(self._number, None) is self:
            self._lost = True

    @property
    def is_open(self) -> bool:
        """Whether it has been closed, by its button, by a key or by :meth:`close`."""
        return self._window is not None

    def show(self, scenes: Sequence[Scene]) -> None:
        """Move from the scenes shown last to these, in the time between them.

        Does nothing once the window is closed. Waits while it is paused. A window that went with a
        `pygame.quit` of another part of the program is opened again.
        """
        if self._lost or (self.is_open and not pygame.display.get_init()):
            self._make(self._mosaic.size)
        before, self._last = self._last or scenes, scenes
        pairs = list(zip(before, scenes, strict=True))
        period = max(0.0, *(b.time_s - a.time_s for a, b in pairs), 0.0)
        now = time.monotonic()
        start = self._due if abs(now - self._due) <= period else now
        self._due = start + period
        share = 0.0
        while self.is_open and share < 1.0:
            share = self._share(start, period)
            self._draw([between(a, b, share) for a, b in pairs])
            self._wait()
        self._hold(scenes)

    @staticmethod
    def _share(start: float, period: float) -> float:
        """How far the picture that appears next is on its way from scene to scene."""
        if not 0.0 < period <= LONGEST_S:
            return 1.0
        ahead = time.monotonic() + 1.0 / FRAMES_S - start
        return min(1.0, max(0.0, ahead / period))

    def _hold(self, scenes: Sequence[Scene]) -> None:
        """Stand still while paused; the camera can be moved."""
        held = self.paused
        while self.is_open and self.paused and not self._stepping:
            self._draw(scenes)
            self._wait()
        self._stepping = False
        if held:
            self._due = time.monotonic()

    def _wait(self) -> None:
        """Let the user act, until the next frame is due."""
        poll()
        if self.is_open:
            self._clock.tick(FRAMES_S)

    def _draw(self, scenes: Sequence[Scene]) -> None:
        if self._window is None:
            return
        size = self._window.size
        if size != self._mosaic.size:
            self._mosaic.resize(size)
        picture = self._mosaic.surface(scenes)
        if self._helped:
            draw_help(picture)
        elif self.paused:
            draw_note(picture, "paused: space to continue")
        elif time.monotonic() < self._noted_until:
            draw_note(picture, "H: what keys and mouse do")
        self._window.get_surface().blit(picture, (0, 0))
        self._window.flip()

    def close(self) -> None:
        """Close the window; a second time does nothing."""
        if self._window is not None:
            if _open.get(self._number) is self:
                del _open[self._number]
                self._window.destroy()
            self._window, self._lost = None, False

    def handle(self, event: pygame.Event) -> None:
        """React to the mouse, the keyboard or the window's button."""
        if event.type == pygame.WINDOWCLOSE:
            self.close()
        elif event.type == pygame.MOUSEMOTION and event.buttons[0]:
            self._orbit(-TURN * event.rel[0], TURN * event.rel[1])
        elif event.type == pygame.MOUSEWHEEL:
            self._zoom(ZOOM**event.y)
        elif event.type == pygame.KEYDOWN:
            self._key(event.key)

    def _key(self, key: int) -> None:
        if key in (pygame.K_ESCAPE, pygame.K_q):
            self.close()
        elif key == pygame.K_SPACE:
            self.paused = not self.paused
        elif key == pygame.K_PERIOD:
            self.paused = self._stepping = True
        elif key == pygame.K_r:
            for view in self._mosaic.views:
                view.follower.reset()
        elif key == pygame.K_h:
            self._helped = not self._helped
        elif key in TURNS:
            self._orbit(*TURNS[key])
        elif key in ZOOMS:
            self._zoom(ZOOMS[key])

    def _orbit(self, azimuth: float, elevation: float) -> None:
        for view in self._mosaic.views:
            view.follower.orbit(azimuth, elevation)

    def _zoom(self, factor: float) -> None:
        for view in self._mosaic.views:
            view.follower.zoom(factor)


def _find_screen() -> None:
    """Start the part of the library that shows windows.

    Without a screen it would draw where nobody sees it, which is right only if asked for.
    """
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error as error:
        driver = str(error)
    if not pygame.display.get_init() or (driver in UNSEEN and "SDL_VIDEODRIVER" not in os.environ):
        pygame.display.quit()
        raise ConfigError(
            f"no window can be opened, there is no screen ({driver}): use render_mode='rgb_array'"
        )


def poll() -> None:
    """Hand the waiting events to the windows they belong to."""
    for event in pygame.event.get():
        if event.type == pygame.QUIT:
            for window in list(_open.values()):
                window.close()
            continue
        named = getattr(event, "window", None)
        if named is not None and named.id in _open:
            _open[named.id].handle(event)
