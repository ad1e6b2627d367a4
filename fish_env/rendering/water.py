"""The water around the fish: the floor with dancing light, the surface from below, haze.

Floor and surface are painted pixel by pixel at a coarse size. The camera is never tilted, so what
depends on the distance of a plane alone is the same along a row.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.arrays import FloatArray, IntArray
from fish_env.rendering.camera import Camera
from fish_env.rendering.light import clearness, water_colour

Pixels = npt.NDArray[np.float32]
TEXELS = 256
TEXTURE_M = 1.6
"""m. Side of the water that one texture covers."""
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

    def reaching(self, depth: float) -> tuple[IntArray, FloatArray]:
        """Rows that meet a level plane, and how far ahead (m)."""
        with np.errstate(divide="ignore"):
            distance = (depth - self.camera.eye[2]) / self.slope
        rows = np.flatnonzero((distance > 0.0) & (distance < FARTHEST))
        return rows, distance[rows]

    def points(self, rows: IntArray, distance: FloatArray) -> tuple[Pixels, Pixels]:
        """North and east (rows, width) where rays at these rows are, so far ahead (m)."""
        ahead, across, below = self.camera.axes
        along = self.camera.eye + distance[:, None] * (ahead + self.down[rows, None] * below)
        start, far = along.astype(np.float32), distance.astype(np.float32)
        north, east = (
            start[:, i, None] + np.outer(far, self.right * np.float32(across[i])) for i in (0, 1)
        )
        return north, east


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
    picture = np.empty((3, size[1], size[0]), np.float32)
    picture[:] = water_colour(rays.steep).T[:, :, None]
    rows, distance = rays.reaching(bottom)
    if len(rows):
        _mix(
            picture, rows, _floor(*rays.points(rows, distance), time_s), _left(rays, rows, distance)
        )
    out_of_water = camera.eye[2] < top
    rows, distance = rays.reaching(top)
    if out_of_water:
        up = np.clip(-2.0 * rays.steep, 0.0, 1.0)[:, None]
        sky = SKY_LOW + up * (SKY_HIGH - SKY_LOW)
        picture[:, rays.steep < 0.0] = sky[rays.steep < 0.0].T[:, :, None]
    if len(rows):
        ceiling = _ceiling(*rays.points(rows, distance), time_s, np.abs(rays.steep[rows]))
        share = _gleam(rays.steep[rows]) if out_of_water else _left(rays, rows, distance)
        _mix(picture, rows, ceiling, share)
    return _as_surface(picture)


def _as_surface(picture: Pixels) -> pygame.Surface:
    """A picture (3, height, width) of colours, which are clipped to 0 to 255."""
    surface = pygame.Surface(picture.shape[:0:-1])
    np.clip(picture, 0.0, 255.0, out=picture)
    red, green, blue = (
        plane << shift
        for plane, shift in zip(picture.astype(np.int32), surface.get_shifts()[:3], strict=True)
    )
    pygame.surfarray.blit_array(surface, (red | green | blue).T)
    return surface


def _mix(picture: Pixels, rows: IntArray, colours: Iterable[Pixels], share: FloatArray) -> None:
    """Put colours, a plane (rows, width) for each of the three, over rows of a picture.

    A plane at a time: numpy is several times as fast on long rows as on three numbers a pixel.
    """
    part, weight = slice(int(rows[0]), int(rows[-1]) + 1), share.astype(np.float32)[:, None]
    for plane, colour in zip(picture[:, part], colours, strict=True):
        colour -= plane
        colour *= weight
        plane += colour


def _left(rays: Rays, rows: IntArray, distance: FloatArray) -> FloatArray:
    return clearness(distance * np.sqrt(1.0 + rays.down[rows] ** 2))


def _gleam(steep: FloatArray) -> FloatArray:
    """How much the surface mirrors, seen from above: little straight down, much at a glance."""
    return 0.10 + 0.75 * (1.0 - np.abs(steep)) ** 3


def _web(north: Pixels, east: Pixels, time_s: float, scale: float) -> Pixels:
    """Light at points, from two webs that drift over each other; 0 to about 1."""
    factor = np.float32(TEXELS / (TEXTURE_M * scale))
    first, second = 0.055 * time_s * factor, 0.043 * time_s * factor
    rows, columns = north * factor, east * factor
    turned = np.float32(0.83)
    one = _looked_up(rows + np.float32(first), columns + np.float32(0.4 * first))
    other = _looked_up(turned * columns - np.float32(second), turned * rows + np.float32(second))
    return np.asarray(np.sqrt(one * other))


def _looked_up(rows: Pixels, columns: Pixels) -> Pixels:
    mask = TEXELS - 1
    index = (rows.astype(np.int32) & mask) * TEXELS + (columns.astype(np.int32) & mask)
    return np.asarray(np.take(caustics(), index))


def _floor(north: Pixels, east: Pixels, time_s: float) -> Iterator[Pixels]:
    """Pale sand in tiles of half a metre under a moving web of light."""
    tiles = (np.floor(2.0 * north) + np.floor(2.0 * east)).astype(np.int32) & 1
    light = 0.62 + 0.05 * tiles.astype(np.float32) + 0.62 * _web(north, east, time_s, 1.0)
    return (light * shade for shade in SAND)


def _ceiling(north: Pixels, east: Pixels, time_s: float, steep: FloatArray) -> Iterator[Pixels]:
    """The surface from below: the sky in a window overhead, around it a mirror of the water."""
    ripple = _web(north, east, 1.6 * time_s, 1.7)
    edge = (steep[:, None] - WINDOW_COSINE).astype(np.float32)
    window = np.clip((edge + 0.35 * (ripple - 0.35)) / 0.12, 0.0, 1.0)
    shine = 105.0 * (ripple * np.sqrt(ripple))
    for dark, bright in zip(MIRROR, ABOVE, strict=True):
        mirror = dark + shine
        yield mirror + window * (bright - mirror)
