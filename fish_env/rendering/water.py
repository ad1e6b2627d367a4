"""The water around the fish: the floor with dancing light, the surface from below, haze.

Floor and surface are painted pixel by pixel at a coarse size. The camera is never tilted, so what
depends on the distance of a plane alone is the same along a row.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.arrays import FloatArray
from fish_env.model.jit import entry_point_of_file, kernel
from fish_env.rendering.camera import Camera
from fish_env.rendering.light import clearness, endless_rows
from fish_env.rendering.raster import Packed, numbers

Pixels = npt.NDArray[np.float32]
TEXELS = 256
TEXTURE_M = 1.6
"""m. Side of the water that one texture covers."""
TURN = np.float32(0.83)
"""How much finer the second web of light is."""
SAND = np.array([176.0, 164.0, 128.0], np.float32)
ABOVE = np.array([198.0, 238.0, 238.0], np.float32)
MIRROR = np.array([36.0, 124.0, 150.0], np.float32)
SKY_HIGH, SKY_LOW = np.array([150.0, 200.0, 228.0]), np.array([226.0, 240.0, 244.0])
FARTHEST = 30.0
"""m. Beyond it all is haze."""
WINDOW_COSINE = 0.66
"""Rays steeper than this leave the water (Snell's window, 48.6 degrees)."""


@cache
def caustics() -> Pixels:
    """(TEXELS, TEXELS) web of light, 0 to 1, that repeats at its edges."""
    rng = np.random.default_rng(7)
    frequency = np.fft.fftfreq(TEXELS, 1.0 / TEXELS)
    radius = np.hypot(*np.meshgrid(frequency, frequency, indexing="ij"))
    band = np.exp(-(((radius - 9.0) / 4.0) ** 2))
    noise = np.fft.ifft2(np.fft.fft2(rng.standard_normal((TEXELS, TEXELS))) * band).real
    return np.asarray(np.exp(-np.abs(noise / noise.std()) * 2.4), np.float32)


class Rays:
    """What each pixel of a coarse picture looks along.

    Attributes:
        slope: (rows,) fall of the ray for each metre ahead.
        steep: (rows,) downward part of its direction, -1 to 1.
    """

    def __init__(self, camera: Camera, size: tuple[int, int]) -> None:
        width, height = size
        self.camera = camera
        right = ((np.arange(width) + 0.5) / width - 0.5) * camera.width / camera.scale
        self.right = right.astype(np.float32)
        self.down = ((np.arange(height) + 0.5) / height - 0.5) * camera.height / camera.scale
        ahead, _, below = camera.axes
        self.slope = ahead[2] + self.down * below[2]
        self.steep = self.slope / np.sqrt(1.0 + self.down**2)

    def plane(self, depth: float) -> Pixels:
        """(rows, 4) of a level plane: north and east of the middle, distance ahead (m), clearness.

        The distance is 0 in rows that do not meet it.
        """
        with np.errstate(divide="ignore"):
            distance = (depth - self.camera.eye[2]) / self.slope
        met = (distance > 0.0) & (distance < FARTHEST)
        distance = np.where(met, distance, 0.0)
        ahead, _, below = self.camera.axes
        along = self.camera.eye + distance[:, None] * (ahead + self.down[:, None] * below)
        left = clearness(distance * np.sqrt(1.0 + self.down**2))
        return np.column_stack([along[:, :2], distance, left]).astype(np.float32)


def paint(
    camera: Camera, size: tuple[int, int], time_s: float, top: float, bottom: float
) -> pygame.Surface:
    """The water without anything in it.

    Args:
        camera: where it is seen from.
        size: width and height of the picture to paint; the camera's may be larger.
        time_s: moves the light (s).
        top: depth of the surface (m).
        bottom: depth of the floor (m).
    """
    rays = Rays(camera, size)
    behind = np.empty((size[1], 3))
    endless_rows(rays.steep, behind)
    floor, ceiling = rays.plane(bottom), rays.plane(top)
    if camera.eye[2] < top:
        up = rays.steep < 0.0
        share = np.clip(-2.0 * rays.steep[up], 0.0, 1.0)[:, None]
        behind[up] = SKY_LOW + share * (SKY_HIGH - SKY_LOW)
        ceiling[:, 3] = _gleam(rays.steep)
    surface = pygame.Surface(size, 0, 32)
    _paint(
        numbers(surface),
        np.array(surface.get_shifts()[:3], np.uint32),
        np.column_stack([behind, np.abs(rays.steep) - WINDOW_COSINE]).astype(np.float32),
        (rays.right[:, None] * camera.axes[1, :2].astype(np.float32)),
        floor,
        ceiling,
        np.array([_drift(time_s, 1.0), _drift(1.6 * time_s, 1.7)], np.float32),
        caustics(),
    )
    return surface


def _drift(time_s: float, scale: float) -> tuple[float, float, float, float]:
    """Texels in a metre, and how far two webs of light have drifted over each other (texels)."""
    factor = float(np.float32(TEXELS / (TEXTURE_M * scale)))
    first, second = 0.055 * time_s * factor, 0.043 * time_s * factor
    return factor, first, 0.4 * first, second


def _gleam(steep: FloatArray) -> FloatArray:
    """How much the surface mirrors, seen from above: little straight down, much at a glance."""
    return 0.10 + 0.75 * (1.0 - np.abs(steep)) ** 3


@kernel
def texel(texture: Pixels, row: Any, column: Any) -> Any:
    """A texture that repeats at its edges, at a place in it."""
    mask = np.int32(TEXELS - 1)
    return texture[np.int32(row) & mask, np.int32(column) & mask]


@kernel
def web(north: Any, east: Any, drift: Pixels, texture: Pixels) -> Any:
    """Light at a point, from two webs that drift over each other; 0 to about 1."""
    row, column = north * drift[0], east * drift[0]
    one = texel(texture, row + drift[1], column + drift[2])
    return np.sqrt(one * texel(texture, TURN * column - drift[3], TURN * row + drift[3]))


@kernel
def byte(value: Any) -> Any:
    """A colour's part as a whole number, 0 to 255."""
    return np.uint32(np.int32(min(max(value, np.float32(0.0)), np.float32(255.0))))


@kernel
def over(below: Any, colour: Any, share: Any) -> Any:
    """A colour that lets as much through as its share is less than 1."""
    return below + (colour - below) * share


@entry_point_of_file
def _paint(
    pixels: Packed,
    shifts: npt.NDArray[np.uint32],
    behind: Pixels,
    across: Pixels,
    floor: Pixels,
    ceiling: Pixels,
    drifts: Pixels,
    texture: Pixels,
) -> None:
    """Paint all pixels.

    The floor is pale sand in tiles of half a metre under a moving web of light. The surface from
    below is the sky in a window overhead, and around it a mirror of the water.

    Args:
        pixels: (rows, columns), filled in.
        shifts: (3,) where a pixel keeps red, green and blue.
        behind: (rows, 4) colour behind all, and how much steeper than the window's rim it is.
        across: (columns, 2) north and east of each column from the middle (m for each m ahead).
        floor: as :meth:`Rays.plane`.
        ceiling: the same of the surface.
        drifts: (2, 4) of the webs of light on both, see :func:`_drift`.
        texture: (TEXELS, TEXELS) web of light.
    """
    zero, one, half = np.float32(0.0), np.float32(1.0), np.float32(0.35)
    base, tile, lit = np.float32(0.62), np.float32(0.05), np.float32(0.62)
    rim, bright = np.float32(0.12), np.float32(105.0)
    line = np.empty((3, pixels.shape[1]), np.float32)
    red, green, blue = line
    for row in range(pixels.shape[0]):
        far, share = floor[row, 2], floor[row, 3]
        high, gleam = ceiling[row, 2], ceiling[row, 3]
        edge = behind[row, 3]
        red[:], green[:], blue[:] = behind[row, 0], behind[row, 1], behind[row, 2]
        for column in range(pixels.shape[1] if far > zero else 0):
            north = floor[row, 0] + far * across[column, 0]
            east = floor[row, 1] + far * across[column, 1]
            odd = (np.int32(np.floor(north + north)) + np.int32(np.floor(east + east))) & np.int32(
                1
            )
            light = base + tile * np.float32(odd) + lit * web(north, east, drifts[0], texture)
            red[column] = over(red[column], light * SAND[0], share)
            green[column] = over(green[column], light * SAND[1], share)
            blue[column] = over(blue[column], light * SAND[2], share)
        for column in range(pixels.shape[1] if high > zero else 0):
            north = ceiling[row, 0] + high * across[column, 0]
            east = ceiling[row, 1] + high * across[column, 1]
            ripple = web(north, east, drifts[1], texture)
            window = min(max((edge + half * (ripple - half)) / rim, zero), one)
            shine = bright * (ripple * np.sqrt(ripple))
            red[column] = over(red[column], over(MIRROR[0] + shine, ABOVE[0], window), gleam)
            green[column] = over(green[column], over(MIRROR[1] + shine, ABOVE[1], window), gleam)
            blue[column] = over(blue[column], over(MIRROR[2] + shine, ABOVE[2], window), gleam)
        for column in range(pixels.shape[1]):
            pixels[row, column] = (
                (byte(red[column]) << shifts[0])
                | (byte(green[column]) << shifts[1])
                | (byte(blue[column]) << shifts[2])
            )
