"""Surfaces made of four-cornered faces, and how to put them together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.arrays import BoolArray, FloatArray

OPAQUE = 255.0


@dataclass(frozen=True)
class Mesh:
    """Faces with a colour each.

    Attributes:
        corners: (n, 4, 3) corners (m), counter-clockwise seen from outside.
        colours: (n, 3) in white light, 0 to 255.
        alphas: (n,) 255 where nothing shows through.
    """

    corners: FloatArray
    colours: FloatArray
    alphas: FloatArray

    def __add__(self, other: Mesh) -> Mesh:
        """Both meshes as one."""
        return Mesh(
            np.concatenate([self.corners, other.corners]),
            np.concatenate([self.colours, other.colours]),
            np.concatenate([self.alphas, other.alphas]),
        )

    def placed(self, rotation: FloatArray, offset: npt.ArrayLike) -> Mesh:
        """Turned by a rotation matrix (3, 3), then moved by an offset (3,)."""
        # All corners in one product: a stack of small ones takes several times as long.
        corners = self.corners.reshape(-1, 3) @ rotation.T + np.asarray(offset)
        return Mesh(corners.reshape(-1, 4, 3), self.colours, self.alphas)

    def chosen(self, which: BoolArray) -> Mesh:
        """Some of the faces; which: (n,)."""
        return Mesh(self.corners[which], self.colours[which], self.alphas[which])

    def turned_over(self) -> Mesh:
        """The same faces seen from the other side."""
        return Mesh(self.corners[:, ::-1], self.colours, self.alphas)

    @cached_property
    def painted(self) -> FloatArray:
        """(n, 4) colours with alphas."""
        return np.column_stack([self.colours, self.alphas])

    @cached_property
    def middles(self) -> FloatArray:
        """(n, 3) middles of the faces (m)."""
        a, b, c, d = (self.corners[:, i] for i in range(4))
        return np.asarray((a + b + c + d) / 4.0)


def grid_mesh(points: FloatArray, colour: npt.ArrayLike, alpha: npt.ArrayLike = OPAQUE) -> Mesh:
    """The faces between neighbours of a grid of points.

    Args:
        points: (rows, columns, 3) (m).
        colour: one colour, or ((rows - 1) * (columns - 1), 3).
        alpha: one, or for each face.
    """
    corners = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    corners = corners.reshape(-1, 4, 3)
    colours = np.broadcast_to(np.asarray(colour, float), (len(corners), 3))
    return Mesh(corners, colours, np.broadcast_to(np.asarray(alpha, float), len(corners)))


def tube(
    along: FloatArray, width: FloatArray, height: FloatArray, sides: int, roundness: float = 2.0
) -> FloatArray:
    """Points (len(along), sides + 1, 3) of a tube along -x with superelliptic sections.

    Args:
        along: (rows,) x of the sections, falling (m).
        width: (rows,) whole widths (m).
        height: (rows,) whole heights (m).
        sides: points around a section.
        roundness: 2 for ellipses, more for boxier sections.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    sine, cosine = np.sin(angle), np.cos(angle)
    y, z = (np.sign(part) * np.abs(part) ** (2.0 / roundness) for part in (sine, -cosine))
    points = np.empty((len(along), sides + 1, 3))
    points[..., 0] = along[:, None]
    points[..., 1] = 0.5 * width[:, None] * y
    points[..., 2] = 0.5 * height[:, None] * z
    return points


def box(size: tuple[float, float, float], colour: npt.ArrayLike) -> Mesh:
    """A box about the origin with sides (x, y, z) (m)."""
    half = 0.5 * np.array(size)
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    faces = []
    for axis in range(3):
        others = [(axis + 1) % 3, (axis + 2) % 3]
        for side in (1.0, -1.0):
            face = np.empty((4, 3))
            face[:, axis] = side
            face[:, others] = square if side > 0 else square[::-1]
            faces.append(face * half)
    corners = np.array(faces)
    return Mesh(corners, np.tile(np.asarray(colour, float), (6, 1)), np.full(6, OPAQUE))


def plate(outline: FloatArray, middle: FloatArray, colour: npt.ArrayLike) -> Mesh:
    """A thin sheet fanned out from a middle line to an outline, seen from both sides.

    Args:
        outline: (n, 3) points in order (m).
        middle: (n, 3) the point of the middle line that each belongs to (m).
        colour: one colour, or for each face of one side.
    """
    one = grid_mesh(np.stack([middle, outline]), colour)
    return one + one.turned_over()


def about_z(angle: float) -> FloatArray:
    """(3, 3) rotation about z, from x to y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about_x(angle: float) -> FloatArray:
    """(3, 3) rotation about x, from y to z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
