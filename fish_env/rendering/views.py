"""From a scene to a picture."""

from __future__ import annotations

from sys import byteorder

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.rendering import markers, surroundings
from fish_env.rendering.body import Fish
from fish_env.rendering.camera import Follower
from fish_env.rendering.canvas import Canvas
from fish_env.rendering.instruments import Instruments
from fish_env.rendering.raster import shrunk
from fish_env.rendering.scene import PICTURE_SIZE, Scene, Setting
from fish_env.rendering.swimmer import Side, Swimmer
from fish_env.rendering.water import paint

Frame = npt.NDArray[np.uint8]
RED_FIRST = (0xFF, 0xFF00, 0xFF0000, 0) if byteorder == "little" else (0xFF0000, 0xFF00, 0xFF, 0)
"""Masks of a surface of three bytes for each pixel, in the order of an array."""
SAMPLING = ((500_000, 2.0, 2), (1_500_000, 1.5, 3), (np.inf, 1.0, 3))
"""Up to how many pixels a picture is drawn how much larger than shown, for smooth edges, and its
water how much coarser, for speed."""


def as_array(surface: pygame.Surface) -> Frame:
    """The colours of a surface (height, width, 3), uint8, as an array of its own."""
    width, height = surface.get_size()
    # The drawing library copies between its own surfaces faster than it writes text of bytes.
    packed = pygame.Surface((width, height), 0, 24, RED_FIRST)
    packed.blit(surface, (0, 0))
    # An array over the surface's own bytes; its rows may be longer than the picture's.
    held: Frame = np.asarray(packed.get_buffer()).view(np.uint8)
    rows = held.reshape(height, packed.get_pitch())[:, : 3 * width]
    return rows.reshape(height, width, 3).copy()


class View:
    """Draws scenes of one fish, its camera following smoothly from scene to scene.

    Args:
        setting: the fish's shape and its tank.
        size: width and height of the pictures (pixels).
        instruments: whether to draw gauges over the picture.
    """

    def __init__(
        self, setting: Setting, size: tuple[int, int] = PICTURE_SIZE, instruments: bool = True
    ) -> None:
        self.setting = setting
        self.fish = Fish.built(setting.shape)
        self.follower = Follower(setting.shape.length + setting.shape.tail_length)
        self.instruments = Instruments(setting) if instruments else None
        self.size = size

    def frame(self, scene: Scene) -> Frame:
        """The picture of a scene: (height, width, 3), uint8."""
        return as_array(self.surface(scene))

    def surface(self, scene: Scene) -> pygame.Surface:
        """The picture of a scene as a surface of the drawing library."""
        self.follower.follow(scene.time_s, scene.position, float(scene.euler[2]))
        shown = self._water_and_fish(scene)
        if self.instruments is not None:
            self.instruments.draw(shown, scene)
        return shown

    def _water_and_fish(self, scene: Scene) -> pygame.Surface:
        width, height = self.size
        unit, coarser = next(how for most, *how in SAMPLING if width * height <= most)
        large = (round(unit * width), round(unit * height))
        tank = self.setting.tank
        camera = self.follower.camera(large, tank.top, tank.bottom)
        coarse = (max(2, round(width / coarser)), max(2, round(height / coarser)))
        water = paint(camera, coarse, scene.time_s, tank.top, tank.bottom)
        canvas = Canvas(pygame.transform.smoothscale(water, large), camera, unit)
        self._draw(canvas, scene)
        return canvas.surface if large == self.size else shrunk(canvas.surface, self.size)

    def _draw(self, canvas: Canvas, scene: Scene) -> None:
        tank = self.setting.tank
        swimmer = Swimmer(canvas, self.fish, scene)
        surroundings.draw_floor_grid(canvas, tank)
        markers.draw_shadow(canvas, swimmer.outline(), tank)
        surroundings.draw_walls(canvas, tank)
        surroundings.draw_specks(canvas, scene.position, tank)
        markers.draw_path(canvas, scene)
        if scene.goal is None:
            swimmer.draw()
            return
        near = Side(scene.goal.depth, bool(canvas.camera.eye[2] < scene.goal.depth))
        beyond = not near.holds(scene.position[None])[0]
        if beyond:
            markers.draw_plumb_line(canvas, scene, scene.goal)
        swimmer.draw(near.other)
        markers.draw_goal_plane(canvas, scene, scene.goal)
        markers.draw_goal_heading(canvas, scene, scene.goal, self.follower.length)
        if not beyond:
            markers.draw_plumb_line(canvas, scene, scene.goal)
        swimmer.draw(near)
