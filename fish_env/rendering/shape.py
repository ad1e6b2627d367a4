"""Sizes of the parts of a fish, from its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray

if TYPE_CHECKING:
    from fish_env.params.schema import FishParams

WIDEST = 0.42
"""Where along the hull it is widest, from the nose."""
PEDUNCLE = 0.24
"""Width of the hull's end, of its largest."""
TAIL_CENTRE = 2.0 / 3.0
"""Where along the tail its centre of pressure lies, as for a triangle from the joint."""


def hull_profile(along: npt.ArrayLike) -> FloatArray:
    """Width of the hull, of its largest, from the nose (0) to the joint of the tail (1)."""
    s = np.clip(np.asarray(along, float), 0.0, 1.0)
    nose = np.sqrt(np.clip(1.0 - (1.0 - s / WIDEST) ** 2, 0.0, 1.0))
    aft = np.clip((s - WIDEST) / (1.0 - WIDEST), 0.0, 1.0)
    stern = 1.0 - (1.0 - PEDUNCLE) * aft * aft * (1.6 - 0.6 * aft)
    return np.asarray(np.where(s < WIDEST, nose, stern))


def _fullness() -> float:
    return float(np.mean(hull_profile(np.linspace(0.0, 1.0, 1001))))


@dataclass(frozen=True)
class FishShape:
    """Sizes of the parts of a fish (m, body frame).

    Attributes:
        nose: x of the nose.
        length: of the hull, from the nose to the joint of the tail.
        width: largest, port to starboard.
        height: largest, back to belly.
        tail_root: (3,) joint of the tail.
        tail_length: from the joint to the tips of the fin.
        tail_span: from tip to tip of the fin.
        block: (3,) size of the weight block.
        block_rest: (3,) its axis at rest: x of its middle, y and z of what it swings about.
        block_radius: from that axis to its middle.
    """

    nose: float
    length: float
    width: float
    height: float
    tail_root: tuple[float, float, float]
    tail_length: float
    tail_span: float
    block: tuple[float, float, float]
    block_rest: tuple[float, float, float]
    block_radius: float

    @classmethod
    def of(cls, fish: FishParams) -> FishShape:
        """The shape whose projected areas are those of the fish.

        The hull is as wide, high and long as gives ``body.area`` from the front, the side and
        above; the tail has its centre of pressure and its area; the block has the inertia of a
        box of its mass.
        """
        front, side, above = (fish.get(f"body.area[{i}]") for i in range(3))
        section = 4.0 * front / np.pi
        length = float(np.sqrt(side * above / section)) / _fullness()
        height = side / (length * _fullness())
        root_x, root_y, root_z = (fish.get(f"tail.root[{i}]") for i in range(3))
        tail_length = fish.get("tail.center_of_pressure") / TAIL_CENTRE
        span = min(1.1 * fish.get("tail.area") / tail_length, 1.2 * height)
        block = "weight_block"
        x, y, z = (fish.get(f"{block}.bracket_origin[{i}]") for i in range(3))
        rest = x + fish.get(f"{block}.d1") + fish.get(f"{block}.d3") - fish.get(f"{block}.s_w0")
        return cls(
            root_x + length,
            length,
            section / height,
            height,
            (root_x, root_y, root_z),
            tail_length,
            span,
            _box(fish, 0.27 * height),
            (rest, y, z),
            fish.get(f"{block}.d2"),
        )

    def block_centre(self, displacement: float, angle: float) -> FloatArray:
        """(3,) middle of the weight block (m, body), displaced aft and swung to starboard."""
        x, y, z = self.block_rest
        swing = self.block_radius * np.array([np.sin(angle), np.cos(angle)])
        return np.array([x - displacement, y + swing[0], z + swing[1]])


def _box(fish: FishParams, largest: float) -> tuple[float, float, float]:
    """Sides of the box with the inertia of the weight block: J_x = m (b^2 + c^2) / 12, ...

    None is larger across the fish than fits into it, however rough the inertia is known.
    """
    inertia = np.array([fish.get(f"inertia.weight_block[{i}]") for i in range(3)])
    squares = 6.0 * (inertia.sum() - 2.0 * inertia) / fish.get("mass.weight_block")
    x, y, z = np.sqrt(np.clip(squares, 1e-4, None))
    return float(x), min(float(y), largest), min(float(z), largest)
