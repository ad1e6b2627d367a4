"""Colours under water: light from above, and haze that grows with distance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray

UP, LEVEL, DOWN = (
    np.array(colour, float) for colour in ((88, 186, 200), (30, 112, 142), (7, 42, 74))
)
"""Colour of endless water seen upwards, level and downwards."""
VISIBILITY, CLEAR = 3.0, 0.6
"""m. Distance over which contrast falls to 1/e, and up to which it does not fall at all."""
SUN = np.array([0.25, -0.35, -0.90])
"""Where light comes from (unit, inertial; up is -z)."""
AMBIENT, SKY, DIRECT, SHINE = 0.46, 0.26, 0.46, 0.35

GOAL = (140, 255, 200)
FISH = (255, 158, 54)


def lengths(vectors: FloatArray) -> FloatArray:
    """Lengths (...,) of vectors (..., 3); on these few columns faster than numpy's own norm."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def water_colour(down: npt.ArrayLike) -> FloatArray:
    """Colours (..., 3) of water seen in directions whose downward part (...,) is -1 to 1."""
    share = np.asarray(down, float)
    up = share < 0.0
    amount = np.minimum(np.abs(share), 1.0) ** np.where(up, 0.8, 0.6)
    towards = np.where(up[..., None], UP - LEVEL, DOWN - LEVEL)
    return np.asarray(LEVEL + towards * amount[..., None])


def clearness(distance: npt.ArrayLike) -> FloatArray:
    """How much of an object's own colour is left at distances (...,) (m)."""
    hazy = np.maximum(np.asarray(distance) - CLEAR, 0.0)
    return np.asarray(np.exp(-hazy / VISIBILITY))


def hazed(colours: FloatArray, points: FloatArray, eye: FloatArray) -> FloatArray:
    """Colours (..., 3) of points (..., 3) seen through the water."""
    ray = points - eye
    distance = lengths(ray)
    left = clearness(distance)[..., None]
    return left * colours + (1.0 - left) * water_colour(ray[..., 2] / np.maximum(distance, 1e-9))


def lit(
    colours: FloatArray, points: FloatArray, normals: FloatArray, eye: FloatArray
) -> FloatArray:
    """Colours (n, 3) of faces: light of the sky from above, of the sun, and a wet shine.

    Args:
        colours: (n, 3) in white light.
        points: (n, 3) middles of the faces (m).
        normals: (n, 3) outward unit normals.
        eye: (3,) m.
    """
    to_eye = eye - points
    to_eye /= lengths(to_eye)[..., None]
    half = to_eye + SUN
    half /= lengths(half)[..., None]
    sky = 0.5 - 0.5 * normals[:, 2]
    direct = np.clip(normals @ SUN, 0.0, 1.0)
    shine = np.clip(np.einsum("ij,ij->i", normals, half), 0.0, 1.0) ** 28
    white = AMBIENT + SKY * sky + DIRECT * direct
    return np.asarray(colours * white[:, None] + 255.0 * SHINE * shine[:, None]).clip(0.0, 255.0)
