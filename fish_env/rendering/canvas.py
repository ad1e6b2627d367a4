"""A picture to draw on: faces, lines and discs of the water, seen by a camera through haze."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from itertools import repeat
from typing import Any

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.rendering.camera import NEAR, Camera
from fish_env.rendering.faces import Faces
from fish_env.rendering.light import clearness, hazed, lengths, water_colour
from fish_env.rendering.mesh import OPAQUE

Colour = tuple[int, int, int]
LARGEST = 20000.0
"""Pixels beyond which a corner is held back: the drawing library counts in small integers."""


class Canvas:
    """What the camera sees, drawn larger than shown so that edges come out smooth.

    Attributes:
        surface: the picture.
        camera: where it is taken from.
        unit: how many pixels of the picture make one that is shown.
    """

    def __init__(self, surface: pygame.Surface, camera: Camera, unit: float) -> None:
        self.surface = surface
        self.camera = camera
        self.unit = unit

    def faces(self, faces: Faces) -> None:
        """Draw the faces of one mesh, the farthest first; none if one is too near to the eye."""
        if not len(faces.pixels) or faces.nearest.min() < NEAR:
            return
        if faces.colours[:, 3].min() >= OPAQUE:
            _fill(self.surface, faces.pixels, faces.colours)
        else:
            self._glaze(faces.pixels, faces.colours)

    def _glaze(self, pixels: FloatArray, rows: IntArray) -> None:
        """Faces that something shows through: they do not overlap, so one layer holds them."""
        layer, low = self._layer(pixels.reshape(-1, 2))
        if layer is not None:
            _fill(layer, pixels - low, rows)
            self.surface.blit(layer, low.tolist())

    def _layer(self, pixels: FloatArray) -> tuple[pygame.Surface | None, IntArray]:
        """A clear layer around pixels (n, 2) as far as they are in the picture, and its corner."""
        size = self.surface.get_size()
        low = np.clip(np.floor(pixels.min(axis=0)) - 1, 0, size).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0)) + 2, 0, size).astype(int)
        if np.any(high <= low):
            return None, low
        return pygame.Surface((high - low).tolist(), pygame.SRCALPHA), low

    def polygon(self, points: FloatArray, colour: npt.ArrayLike) -> None:
        """A flat polygon (n, 3) in a colour as seen, without light or haze."""
        pixels, ahead = self.camera.project(points)
        if ahead.min() > NEAR:
            shade = _whole(np.asarray(colour)).tolist()
            pygame.draw.polygon(self.surface, shade, _held(pixels).tolist())

    def lines(
        self,
        starts: FloatArray,
        ends: FloatArray,
        colours: FloatArray,
        widths: FloatArray,
        ground: npt.ArrayLike | None = None,
    ) -> None:
        """Straight lines in the water.

        Args:
            starts: (n, 3) (m).
            ends: (n, 3) (m).
            colours: (n, 3), or (n, 4) with the strength that is left of them, 0 to 1.
            widths: (n,) (m); at least a pixel is drawn.
            ground: (3,) colour that faint lines fade to; None: that of the water.
        """
        if not len(starts):
            return
        starts, ends, kept, seen = self._clipped(starts, ends)
        (first, near), (last, _) = (self.camera.pictured(points) for points in seen)
        # What is behind the eye is not drawn, but must not divide by zero either.
        pixels = self.camera.scale * widths / np.maximum(near, 0.5 * NEAR)
        thick = np.maximum(np.rint(pixels), max(1.0, round(0.7 * self.unit)))
        shown = np.flatnonzero(kept & self._touching(first, last, thick))
        if not len(shown):
            return
        middles = 0.5 * (starts + ends)[shown]
        mixed = _packed(self.surface, _whole(self.faded(colours[shown], middles, ground)))
        columns = (rows[shown].tolist() for rows in (first, last, thick.astype(int)))
        _each(pygame.draw.line, self.surface, mixed, *columns)

    def _touching(self, first: FloatArray, last: FloatArray, thick: FloatArray) -> BoolArray:
        """(n,) lines between pixels (n, 2) that are not altogether beside the picture."""
        margin = thick[:, None] + 2.0
        after = np.maximum(first, last) > -margin
        before = np.minimum(first, last) < self.surface.get_size() + margin
        return np.asarray((after & before).all(axis=1))

    def faded(
        self, colours: FloatArray, points: FloatArray, ground: npt.ArrayLike | None = None
    ) -> FloatArray:
        """Colours (n, 3) at points seen through haze; a fourth column (n, 4) thins them."""
        eye = self.camera.eye
        if colours.shape[1] == 3:
            return hazed(colours, points, eye)
        own, left = colours[:, :3], colours[:, 3:]
        if ground is not None:
            return hazed(left * own + (1.0 - left) * np.asarray(ground), points, eye)
        ray = points - eye
        down = ray[:, 2] / lengths(ray)
        return left * hazed(own, points, eye) + (1.0 - left) * water_colour(down)

    def _clipped(
        self, starts: FloatArray, ends: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray, list[FloatArray]]:
        """Lines cut off where they come too near to the eye, which are left, and as seen."""
        seen = [self.camera.seen(points) for points in (starts, ends)]
        ahead = seen[0][:, 0], seen[1][:, 0]
        kept = np.maximum(*ahead) > NEAR
        crossing = kept & (np.minimum(*ahead) < NEAR)
        if not crossing.any():
            return starts, ends, kept, seen
        span = np.where(np.abs(ahead[1] - ahead[0]) > 1e-9, ahead[1] - ahead[0], 1.0)
        share = ((NEAR - ahead[0]) / span)[:, None]
        cut = starts + share * (ends - starts)
        first, last = (
            np.where((crossing & (far < NEAR))[:, None], cut, points)
            for far, points in zip(ahead, (starts, ends), strict=True)
        )
        return first, last, kept, [self.camera.seen(points) for points in (first, last)]

    def discs(self, points: FloatArray, radii: FloatArray, colours: FloatArray) -> None:
        """Small round things (n, 3) with radii (n,) (m) and colours (n, 3 or 4)."""
        pixels, ahead = self.camera.project(points)
        width, height = self.surface.get_size()
        inside = (ahead > 3.0 * NEAR) & np.all((pixels > 0) & (pixels < (width, height)), axis=1)
        size = self.camera.scale * radii[inside] / ahead[inside]
        mixed = self.faded(colours[inside], points[inside])
        rims = np.maximum(size, 0.6 * self.unit).tolist()
        shades = _packed(self.surface, _whole(mixed))
        _each(pygame.draw.circle, self.surface, shades, pixels[inside].tolist(), rims)

    def sheet(self, outline: FloatArray, colour: Colour, alpha: float) -> None:
        """A flat outline (n, 3) filled with a colour that lets things through (alpha 0 to 1)."""
        corners = self._in_front(outline)
        if len(corners) < 3:
            return
        pixels = self.camera.project(corners)[0]
        self._tint(pixels[None], corners.mean(axis=0)[None], colour, alpha)

    def sheets(self, outlines: FloatArray, colour: Colour, alpha: float) -> None:
        """As :meth:`sheet`, of several outlines (k, n, 3), the first of them drawn first."""
        seen = self.camera.seen(outlines)
        if seen[..., 0].min() <= 1.01 * NEAR:
            for outline in outlines:
                self.sheet(outline, colour, alpha)
            return
        self._tint(self.camera.pictured(seen)[0], outlines.mean(axis=1), colour, alpha)

    def _tint(
        self, outlines: FloatArray, middles: FloatArray, colour: Colour, alpha: float
    ) -> None:
        """Fill outlines (k, n, 2) on the picture, whose middles (k, 3) say how hazy they are."""
        pixels, distances = _held(outlines), lengths(middles - self.camera.eye)
        strengths = np.rint(255 * alpha * clearness(0.5 * distances)).astype(int).tolist()
        size = self.surface.get_size()
        lows = np.clip(np.floor(pixels.min(axis=1)) - 1, 0, size).astype(int)
        highs = np.clip(np.ceil(pixels.max(axis=1)) + 2, 0, size).astype(int)
        inside = (pixels - lows[:, None]).tolist()
        corners = lows.tolist(), (highs - lows).tolist()
        for low, room, points, strength in zip(*corners, inside, strengths, strict=True):
            if min(room) > 0:
                layer = pygame.Surface(room, pygame.SRCALPHA)
                pygame.draw.polygon(layer, (*colour, strength), points)
                self.surface.blit(layer, low)

    def _in_front(self, outline: FloatArray) -> FloatArray:
        """The outline without what is behind the eye (Sutherland and Hodgman)."""
        ahead = self.camera.seen(outline)[:, 0] - 1.01 * NEAR
        if ahead.min() > 0.0:
            return outline
        kept: list[FloatArray] = []
        for i in range(len(outline)):
            j = (i + 1) % len(outline)
            if ahead[i] > 0.0:
                kept.append(outline[i])
            if (ahead[i] > 0.0) != (ahead[j] > 0.0):
                share = ahead[i] / (ahead[i] - ahead[j])
                kept.append(outline[i] + share * (outline[j] - outline[i]))
        return np.array(kept).reshape(-1, 3)


def _fill(surface: pygame.Surface, pixels: FloatArray, rows: IntArray) -> None:
    """Fill four-cornered faces (n, 4, 2) with colours and alphas (n, 4)."""
    # Columns: a list for each face would keep the garbage collector busy.
    columns = _held(pixels).reshape(-1, 8).T.tolist()
    corners = (zip(*columns[i : i + 2], strict=True) for i in (0, 2, 4, 6))
    faces = zip(*corners, strict=True)
    _each(pygame.draw.polygon, surface, _packed(surface, rows), faces)


def _each(draw: Callable[..., object], surface: pygame.Surface, *columns: Iterable[Any]) -> None:
    """Call a drawing function for each row of the columns, without a loop of the interpreter."""
    deque(map(draw, repeat(surface), *columns), maxlen=0)


def _packed(surface: pygame.Surface, colours: IntArray) -> list[int]:
    """Colours (n, 3), or (n, 4) with alphas, as the numbers that a surface keeps of them.

    The drawing library takes a number as it is; a tuple costs it as much as a small face.
    """
    shifts = surface.get_shifts()
    rows = colours.T
    numbers = (rows[0] << shifts[0]) | (rows[1] << shifts[1]) | (rows[2] << shifts[2])
    if surface.get_masks()[3]:
        numbers |= (rows[3] if len(rows) == 4 else 255) << shifts[3]
    packed: list[int] = numbers.tolist()
    return packed


def _whole(colours: FloatArray) -> IntArray:
    return np.clip(colours, 0.0, 255.0).astype(np.int64)


def _held(pixels: FloatArray) -> FloatArray:
    return np.clip(pixels, -LARGEST, LARGEST)
