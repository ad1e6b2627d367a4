"""Numbers of a policy: each with its range, its source and what it decides.

A number has a source, or was calibrated by a script of the project, or was set by hand, and says
which. ``docs/policy.md`` is made from the policies, and every ``diagnosis.json`` holds the values
that it was made with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

BY_HAND = "set by hand, not calibrated"
EFFORT = "limits effort; " + BY_HAND
FISHER = "convention (Fisher, 1925)"
AKAIKE = "Akaike (1974), IEEE TAC 19"


def number(value: float, low: float, high: float, source: str) -> Any:
    """A field of a policy.

    Args:
        value: the number.
        low: smallest value allowed.
        high: largest value allowed.
        source: where the value comes from.
    """
    return field(default=value, metadata={"low": low, "high": high, "source": source})


@dataclass(frozen=True)
class Numbers:
    """What every policy does with its numbers."""

    def __post_init__(self) -> None:
        """Refuse values out of range.

        Raises:
            ValueError: names the number and its range.
        """
        for item in fields(self):
            value, low, high = getattr(self, item.name), item.metadata["low"], item.metadata["high"]
            if not low <= value <= high:
                raise ValueError(f"policy {item.name}: choose a value from {low} to {high}")

    def as_dict(self) -> dict[str, float]:
        """Name -> value, as written into ``diagnosis.json``."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def table(self) -> list[tuple[str, float, str]]:
        """Name, value and source of each number, for the documentation."""
        return [(i.name, getattr(self, i.name), i.metadata["source"]) for i in fields(self)]

    def meanings(self) -> Mapping[str, str]:
        """Name -> what the number decides, as the class says it."""
        text = (type(self).__doc__ or "").partition("Attributes:")[2]
        names, found = {item.name for item in fields(self)}, dict[str, str]()
        name = ""
        for line in text.strip().splitlines():
            head, _, rest = line.strip().partition(": ")
            name, said = (head, rest) if head in names else (name, line.strip())
            found[name] = f"{found.get(name, '')} {said}".strip()
        return {name: said.rstrip(".") for name, said in found.items()}
