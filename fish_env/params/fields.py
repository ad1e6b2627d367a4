"""How a parameter is declared: unit, bounds, symbol and prior group beside the dataclass field.

The parameter groups are plain frozen dataclasses. The helpers here attach a `Spec` to a field, and
`leaves` walks any group and yields each number with its path and its `Spec`, so that reading,
checking, flattening and documenting all follow from one declaration.
"""

import dataclasses
import math
import numbers
from collections.abc import Iterator
from typing import Any, Literal

from fish_env.params.tables import CoefficientTable, TableKind

PriorGroup = Literal[
    "mass", "trim", "static_moment", "inertia", "geometry", "hydrodynamic", "damping"
]


@dataclasses.dataclass(frozen=True)
class Spec:
    """What is declared of one number.

    Attributes:
        unit: SI unit, "-" for a pure number.
        symbol: Symbol in the model's equations.
        description: One line in plain words.
        lower: Smallest value that is physically possible.
        upper: Largest value that is plausible for any swimming robot.
        prior: Group that sets how far the value may be off; None for a known value.
    """

    unit: str
    symbol: str
    description: str
    lower: float = -math.inf
    upper: float = math.inf
    prior: PriorGroup | None = None


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number in a parameter tree: its path, its value and what is declared of it."""

    path: str
    value: Any
    spec: Spec


def number(spec: Spec, table: TableKind | None = None) -> Any:
    """Declares a scalar field; `table` names the curve that a table may give in its place."""
    return dataclasses.field(metadata={"spec": spec, "table": table})


def vector(spec: Spec) -> Any:
    """Declares a field of three numbers, one per body axis x, y, z, sharing one `Spec`."""
    return dataclasses.field(metadata={"spec": spec, "axes": 3})


def section(cls: type, table: TableKind | None = None) -> Any:
    """Declares a nested group; `table` names the curve that a table may give in its place."""
    return dataclasses.field(metadata={"section": cls, "table": table})


def aside(cls: type) -> Any:
    """Declares a nested group that says something about the parameters but holds none of them."""
    return dataclasses.field(metadata={"aside": cls})


def join(path: str, name: str) -> str:
    """Appends a key to a dotted path."""
    return f"{path}.{name}" if path else name


def as_number(value: Any) -> Any:
    """Returns a real number as a float; leaves anything else, booleans too, to the checks."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return value
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)


def parameter_fields(group: Any) -> Iterator[dataclasses.Field[Any]]:
    """Yields the fields of a group, instance or class, that declare parameters."""
    for field in dataclasses.fields(group):
        if "spec" in field.metadata or "section" in field.metadata:
            yield field


def leaves(group: Any, path: str = "") -> Iterator[Leaf]:
    """Yields every number of a group in file order, leaving out what a table replaces."""
    for field in parameter_fields(group):
        value, here = getattr(group, field.name), join(path, field.name)
        if isinstance(value, CoefficientTable):
            continue
        if "section" in field.metadata:
            yield from leaves(value, here)
        elif "axes" in field.metadata:
            for index, item in enumerate(value):
                yield Leaf(f"{here}[{index}]", item, field.metadata["spec"])
        else:
            yield Leaf(here, value, field.metadata["spec"])


def tables(group: Any, path: str = "") -> Iterator[tuple[str, CoefficientTable]]:
    """Yields every coefficient table of a group with its path, in file order."""
    for field in parameter_fields(group):
        value, here = getattr(group, field.name), join(path, field.name)
        if isinstance(value, CoefficientTable):
            yield here, value
        elif "section" in field.metadata:
            yield from tables(value, here)
