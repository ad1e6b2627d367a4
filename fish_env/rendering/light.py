"""Colours under water: light from above, and haze that grows with distance."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.model.jit import entry_point_of_file, kernel

Colour = tuple[float, float, float]
UP, LEVEL, DOWN = (88.0, 186.0, 200.0), (30.0, 112.0, 142.0), (7.0, 42.0, 74.0)
"""Colour of endless water seen upwards, level and downwards."""
VISIBILITY, CLEAR = 3.0, 0.6
"""m. Distance over which contrast falls to 1/e, and up to which it does not fall at all."""
SUN = (0.25, -0.35, -0.90)
"""Where light comes from (unit, inertial; up is -z)."""
AMBIENT, SKY, DIRECT, SHINE = 0.46, 0.26, 0.46, 0.35

GOAL = (140, 255, 200)
FISH = (255, 158, 54)


def lengths(vectors: FloatArray) -> FloatArray:
    """Lengths (...,) of vectors (..., 3); on these few columns faster than numpy's own norm."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def clearness(distance: npt.ArrayLike) -> FloatArray:
    """How much of an object's own colour is left at distances (...,) (m)."""
    hazy = np.maximum(np.asarray(distance) - CLEAR, 0.0)
    return np.asarray(np.exp(-hazy / VISIBILITY))


@kernel
def left_at(distance: float) -> float:
    """As :func:`clearness`, of one distance."""
    return math.exp(-max(distance - CLEAR, 0.0) / VISIBILITY)


@kernel
def endless(down: float) -> Colour:
    """Colour of water seen in a direction whose downward part is -1 to 1."""
    share = min(abs(down), 1.0) ** (0.8 if down < 0.0 else 0.6)
    to_red = UP[0] if down < 0.0 else DOWN[0]
    to_green = UP[1] if down < 0.0 else DOWN[1]
    to_blue = UP[2] if down < 0.0 else DOWN[2]
    return (
        LEVEL[0] + (to_red - LEVEL[0]) * share,
        LEVEL[1] + (to_green - LEVEL[1]) * share,
        LEVEL[2] + (to_blue - LEVEL[2]) * share,
    )


@kernel
def hazed(colour: Colour, ray: tuple[float, float, float]) -> Colour:
    """A colour seen through the water, along a ray from the eye (m)."""
    x, y, z = ray
    distance = math.sqrt(x * x + y * y + z * z)
    left = left_at(distance)
    water = endless(z / max(distance, 1e-9))
    return (
        left * colour[0] + (1.0 - left) * water[0],
        left * colour[1] + (1.0 - left) * water[1],
        left * colour[2] + (1.0 - left) * water[2],
    )


@kernel
def lit(
    colour: Colour, normal: tuple[float, float, float], to_eye: tuple[float, float, float]
) -> Colour:
    """A colour under the light of the sky from above, of the sun, and with a wet shine.

    Args:
        colour: in white light.
        normal: outward unit normal.
        to_eye: towards the eye, of any length.
    """
    distance = math.sqrt(to_eye[0] ** 2 + to_eye[1] ** 2 + to_eye[2] ** 2)
    x, y, z = to_eye[0] / distance + SUN[0], to_eye[1] / distance + SUN[1], to_eye[2] / distance
    z += SUN[2]
    half = math.sqrt(x * x + y * y + z * z)
    shine = max(0.0, min(1.0, (normal[0] * x + normal[1] * y + normal[2] * z) / half))
    direct = max(0.0, min(1.0, normal[0] * SUN[0] + normal[1] * SUN[1] + normal[2] * SUN[2]))
    white = AMBIENT + SKY * (0.5 - 0.5 * normal[2]) + DIRECT * direct
    gleam = 255.0 * SHINE * shine**28
    return (
        max(0.0, min(255.0, colour[0] * white + gleam)),
        max(0.0, min(255.0, colour[1] * white + gleam)),
        max(0.0, min(255.0, colour[2] * white + gleam)),
    )


@kernel
def faded(colour: Colour, left: float, ground: Colour, ray: tuple[float, float, float]) -> Colour:
    """A faint colour in the water as it is seen.

    Args:
        colour: its own.
        left: how much of it is left, 0 to 1.
        ground: what is behind it, before the haze; negative: the endless water.
        ray: from the eye to it (m).
    """
    other = 1.0 - left
    if ground[0] >= 0.0:
        mixed = (
            left * colour[0] + other * ground[0],
            left * colour[1] + other * ground[1],
            left * colour[2] + other * ground[2],
        )
        return hazed(mixed, ray)
    near = hazed(colour, ray)
    distance = math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2)
    water = endless(ray[2] / max(distance, 1e-9))
    return (
        left * near[0] + other * water[0],
        left * near[1] + other * water[1],
        left * near[2] + other * water[2],
    )


@entry_point_of_file
def fade(
    colours: FloatArray, points: FloatArray, eye: FloatArray, ground: Colour, out: FloatArray
) -> None:
    """Colours as they are seen, see :func:`faded`.

    Args:
        colours: (n, 4) with how much of them is left, 0 to 1.
        points: (n, 3) m.
        eye: (3,) m.
        ground: what faint ones fade to; negative: the water.
        out: (n, 3), filled in.
    """
    for i in range(len(points)):
        ray = points[i, 0] - eye[0], points[i, 1] - eye[1], points[i, 2] - eye[2]
        colour = colours[i, 0], colours[i, 1], colours[i, 2]
        out[i, 0], out[i, 1], out[i, 2] = faded(colour, colours[i, 3], ground, ray)


@entry_point_of_file
def endless_rows(down: FloatArray, out: FloatArray) -> None:
    """Colours (n, 3) of water seen in directions whose downward parts (n,) are -1 to 1."""
    for i in range(len(down)):
        out[i, 0], out[i, 1], out[i, 2] = endless(down[i])
