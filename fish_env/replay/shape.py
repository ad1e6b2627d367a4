"""The size of a fish for drawing, from its parameters.

The hull is drawn as the ellipsoid with the fish's three projected areas. With length l, height h
and width w these are pi/4 h w (frontal), pi/4 l h (side) and pi/4 l w (top), which gives all three.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.params import FishParams

FloatArray = npt.NDArray[np.float64]
BLOCK_DENSITY = 11340.0
"""kg/m^3, lead. Only the drawn size of the weight block follows from it."""


def shape_of(fish: FishParams) -> dict[str, Any]:
    """Lengths (m) of hull, tail and weight block, and where the tail's root is (m, body).

    The drawn tail reaches as far behind its centre of pressure as that is behind the root.
    """
    front, side, top = (fish.get(f"body.area[{i}]") for i in range(3))
    tail_length = 2.0 * fish.get("tail.center_of_pressure")
    return {
        "length": float(np.sqrt(4.0 / np.pi * side * top / front)),
        "height": float(np.sqrt(4.0 / np.pi * front * side / top)),
        "width": float(np.sqrt(4.0 / np.pi * front * top / side)),
        "tailRoot": [fish.get(f"tail.root[{i}]") for i in range(3)],
        "tailLength": tail_length,
        "tailHeight": fish.get("tail.area") / tail_length,
        "block": float(np.cbrt(fish.get("mass.weight_block") / BLOCK_DENSITY)),
    }


def block_position(fish: FishParams, block: FloatArray) -> FloatArray:
    """Centre of the weight block (m, body), shape (m, 3), from displacement and angle (m, 2).

    C_w = [a_rb + d1 - (s_w0 + dd - d3), b_rb + d2 sin xi2, c_rb + d2 cos xi2], see
    :mod:`fish_env.model.mass_properties`.
    """
    x, y, z = (fish.get(f"weight_block.bracket_origin[{i}]") for i in range(3))
    d1, d2, d3, s_w0 = (fish.get(f"weight_block.{name}") for name in ("d1", "d2", "d3", "s_w0"))
    displacement, angle = block.T
    return np.column_stack(
        [x + d1 - (s_w0 + displacement - d3), y + d2 * np.sin(angle), z + d2 * np.cos(angle)]
    )
