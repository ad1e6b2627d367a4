"""A picture to draw on: faces, lines and discs of the water, seen by a camera through haze."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from itertools import repeat
from typing import Any

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.arrays import FloatArray, IntArray
from fish_env.rendering.camera import NEAR, Camera
from fish_env.rendering.faces import Faces
from fish_env.rendering.light import clearness, fade, lengths
from fish_env.rendering.mesh import OPAQUE
from fish_env.rendering.raster import fill, numbers
from fish_env.rendering.strokes import see_lines

Colour = tuple[int, int, int]
WATER = (-1.0, -1.0, -1.0)
"""In place of a ground: faint colours fade to that of the endless water."""


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
            _fill(self.surface, pixels[None], _whole(np.asarray(colour))[None])

    def lines(
        self,
        starts: FloatArray,
        ends: FloatArray,
        colours: FloatArray,
        widths: FloatArray,
        ground: npt.ArrayLike | None = None,
        faintest: float = 0.0,
    ) -> None:
        """Straight lines in the water.

        Args:
            starts: (n, 3) (m).
            ends: (n, 3) (m).
            colours: (n, 3), or (n, 4) with the strength that is left of them, 0 to 1.
            widths: (n,) (m); at least a pixel is drawn.
            ground: (3,) colour that faint lines fade to; None: that of the water.
            faintest: lines of which no more than this would be seen are left out, 0 to 1.
        """
        camera, count = self.camera, len(starts)
        left = np.ones(count) if colours.shape[1] == 3 else colours[:, 3]
        paint = np.column_stack([colours[:, :3], left, widths])
        view = np.vstack([camera.eye, camera.axes])
        least = max(1.0, round(0.7 * self.unit))
        frame = np.array([camera.scale, camera.width, camera.height, least, faintest])
        pixels, shades = np.empty((count, 5)), np.empty((count, 3), np.int64)
        both = np.stack([starts, ends], axis=1)
        shown = see_lines(both, paint, view, frame, _ground(ground), pixels, shades)
        places = pixels[:shown]
        mixed = _packed(self.surface, shades[:shown]).tolist()
        columns = places[:, :2].tolist(), places[:, 2:4].tolist(), places[:, 4].astype(int).tolist()
        _each(pygame.draw.line, self.surface, mixed, *columns)

    def faded(self, colours: FloatArray, points: FloatArray) -> FloatArray:
        """Colours (n, 3) at points seen through haze; a fourth column (n, 4) thins them."""
        whole = np.ones((len(colours), 4))
        whole[:, : colours.shape[1]] = colours
        out = np.empty((len(colours), 3))
        fade(whole, np.ascontiguousarray(points), self.camera.eye, WATER, out)
        return out

    def discs(self, points: FloatArray, radii: FloatArray, colours: FloatArray) -> None:
        """Small round things (n, 3) with radii (n,) (m) and colours (n, 3 or 4)."""
        pixels, ahead = self.camera.project(points)
        width, height = self.surface.get_size()
        inside = (ahead > 3.0 * NEAR) & np.all((pixels > 0) & (pixels < (width, height)), axis=1)
        size = self.camera.scale * radii[inside] / ahead[inside]
        mixed = self.faded(colours[inside], points[inside])
        rims = np.maximum(size, 0.6 * self.unit).tolist()
        shades = _packed(self.surface, _whole(mixed)).tolist()
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
        distances = lengths(middles - self.camera.eye)
        alphas = np.rint(255 * alpha * clearness(0.5 * distances)).astype(np.int64)
        colours = _packed(self.surface, np.tile(np.array(colour), (len(outlines), 1)))
        fill(numbers(self.surface), np.ascontiguousarray(outlines), colours, alphas)

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


def _fill(surface: pygame.Surface, outlines: FloatArray, colours: IntArray) -> None:
    """Fill outlines (n, corners, 2) with colours and alphas (n, 4), which replace what is there."""
    opaque = np.full(len(outlines), 255)
    fill(numbers(surface), np.ascontiguousarray(outlines), _packed(surface, colours), opaque)


def _ground(colour: npt.ArrayLike | None) -> tuple[float, float, float]:
    if colour is None:
        return WATER
    red, green, blue = np.asarray(colour, float).tolist()
    return red, green, blue


def _each(draw: Callable[..., object], surface: pygame.Surface, *columns: Iterable[Any]) -> None:
    """Call a drawing function for each row of the columns, without a loop of the interpreter."""
    deque(map(draw, repeat(surface), *columns), maxlen=0)


def _packed(surface: pygame.Surface, colours: IntArray) -> IntArray:
    """Colours (n, 3), or (n, 4) with alphas, as the numbers (n,) that a surface keeps of them."""
    shifts = surface.get_shifts()
    rows = colours.T
    packed: IntArray = (rows[0] << shifts[0]) | (rows[1] << shifts[1]) | (rows[2] << shifts[2])
    if surface.get_masks()[3]:
        packed |= (rows[3] if len(rows) == 4 else 255) << shifts[3]
    return packed


def _whole(colours: FloatArray) -> IntArray:
    return np.clip(colours, 0.0, 255.0).astype(np.int64)
