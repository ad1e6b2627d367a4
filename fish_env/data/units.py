"""Units a file may use, and their conversion to SI and radians."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fish_env.data.place import Place, closest
from fish_env.data.vocabulary import Quantity

_FACTORS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "speed": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001},
    "rate": {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    "frequency": {"Hz": 1.0},
    "time": {"s": 1.0},
    "number": {"1": 1.0},
}

SI_UNIT: dict[str, str] = {dimension: next(iter(units)) for dimension, units in _FACTORS.items()}
"""SI unit of each dimension."""


@dataclass(frozen=True)
class Unit:
    """A unit: its name in the file, and the factor that turns a value in it into SI."""

    name: str
    factor: float


def parse_unit(name: str, quantity: Quantity, place: Place) -> Unit:
    """Finds a unit by name and checks that it can measure the quantity.

    Args:
        name: The unit as the file writes it.
        quantity: What is measured in it.
        place: Where the unit is written.

    Raises:
        DatasetError: The unit is unknown, or of another dimension.
    """
    fitting = _FACTORS[quantity.dimension]
    if name in fitting:
        return Unit(name, fitting[name])
    every = [unit for units in _FACTORS.values() for unit in units]
    if name not in every:
        raise place.refuse(f"unknown unit '{name}'", closest(name, every))
    raise place.refuse(
        f"the unit '{name}' does not measure this, which is of dimension {quantity.dimension}",
        f"Use one of: {', '.join(fitting)}",
    )


def unwrap_angle(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Removes the jumps of whole turns from a measured angle.

    A yaw is kept as it was measured, wrapped or winding on; this makes it continuous where a
    computation needs that. Gaps are bridged: each sample is unwrapped against the last one
    measured before it.

    Args:
        angle_rad: Angle, shape (n,), rad; NaN where it was not measured.

    Returns:
        The continuous angle, shape (n,), rad, equal to the input at its first sample.
    """
    measured = np.isfinite(angle_rad)
    result = angle_rad.copy()
    result[measured] = np.unwrap(angle_rad[measured])
    return result
