"""Units a file may use, and their conversion to SI and radians.

The short names of the table below are read without help. Any other spelling ("degrees", "°/s",
"inches", "rpm") is read by pint, which is imported only then: it takes about 0.6 s.
"""

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.place import Place
from fish_env.data.vocabulary import Quantity
from fish_env.reading import short

_FACTORS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "speed": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001},
    "rate": {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    "frequency": {"Hz": 1.0},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "number": {"1": 1.0},
}

SI_UNIT: dict[str, str] = {dimension: next(iter(units)) for dimension, units in _FACTORS.items()}
"""SI unit of each dimension."""

_ROOTS: dict[str, dict[str, int]] = {
    "length": {"meter": 1},
    "angle": {"radian": 1},
    "speed": {"meter": 1, "second": -1},
    "rate": {"radian": 1, "second": -1},
    "frequency": {"second": -1},
    "time": {"second": 1},
    "number": {},
}
"""What pint reduces a unit of each dimension to; it keeps the radian apart from a mere number."""

_LONGEST = 40
"""Characters. No unit has a longer name, and a parser should not be fed with text without end."""

_POWER = re.compile(r"(\*\*|\^)(?!\s*-?\d(?!\s*(\*\*|\^|\d)))")
"""An exponent other than one digit: a parser would work out `9**9**9`."""

_PIXELS = ("px", "pixel", "pixels")
_GRAD = re.compile(r"grad(?:/s|/sec)?")
"""A degree in German, a tenth less (the gradian) in English."""
_DEGREE_SIGNS = str.maketrans({"\N{MASCULINE ORDINAL INDICATOR}": "°", "\N{RING ABOVE}": "°"})


@dataclass(frozen=True)
class Unit:
    """A unit: its name in the file, and the factor that turns a value in it into SI."""

    name: str
    factor: float


def parse_unit(name: str, quantity: Quantity, place: Place) -> Unit:
    """Finds a unit by name and checks that it can measure the quantity.

    A unit of the table keeps its short name there, however it is spelt: "degrees" is "deg".

    Args:
        name: The unit as the file writes it, in any spelling that pint knows.
        quantity: What is measured in it.
        place: Where the unit is written.

    Raises:
        DatasetError: The unit is unknown, or of another dimension.
    """
    fitting = _FACTORS[quantity.dimension]
    if name in fitting:
        return Unit(name, fitting[name])
    remedy = f"Use one of: {', '.join(fitting)}, or another spelling of such a unit"
    if name.lower() in _PIXELS:
        raise place.refuse(
            "a pixel has no fixed size",
            f"Give the size of one as `scale`, with the unit '{next(iter(fitting))}'",
        )
    if _GRAD.fullmatch(name):
        raise place.refuse(
            f"'{name}' may mean degrees or gradians",
            f"Write {name.replace('grad', 'deg')} or {name.replace('grad', 'gon')}",
        )
    known = [root for root in (unit_root(name), unit_root(name.lower())) if root is not None]
    for factor, root in known:
        if root == _ROOTS[quantity.dimension]:
            return _short(name, factor, fitting)
        if quantity.dimension == "frequency" and root == _ROOTS["rate"]:
            # A turn is one cycle: 60 rpm are 1 Hz.
            return _short(name, factor / (2.0 * math.pi), fitting)
    if not known and not any(name in units for units in _FACTORS.values()):
        raise place.refuse(f"unknown unit '{short(name)}'", remedy)
    raise place.refuse(
        f"the unit '{short(name)}' does not measure this, which is of dimension "
        f"{quantity.dimension}",
        remedy,
    )


def _short(name: str, factor: float, fitting: dict[str, float]) -> Unit:
    """The unit by its name in the table if it is there, else as it was written."""
    for usual, known in fitting.items():
        if math.isclose(factor, known, rel_tol=1e-12):
            return Unit(usual, known)
    return Unit(name, factor)


@cache
def unit_root(name: str) -> tuple[float, dict[str, int]] | None:
    """Reduces a unit to SI base units and the radian.

    Args:
        name: The unit in any spelling that pint knows.

    Returns:
        The factor to SI, and the power of each base unit by pint's name; None if unknown.
    """
    text = name.strip().translate(_DEGREE_SIGNS)
    if not text or len(text) > _LONGEST or _POWER.search(text):
        return None
    registry = _registry()
    try:
        factor, root = registry.get_root_units(registry.parse_units(text))
    # pint raises errors of many kinds, AssertionError and TokenError among them.
    except Exception:
        return None
    return float(factor), {str(unit): power for unit, power in root._units.items()}


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry()
    # Pint alone takes the German degree, "Grad", for a gigaradian.
    for alias in ("@alias hertz = hz", "@alias revolution = rev", "@alias degree = Grad"):
        registry.define(alias)
    return registry


def unwrap_angle(angle_rad: FloatArray) -> FloatArray:
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
