"""Units that the report shows channels and observations in."""

from __future__ import annotations

from fish_env.comparison.words import shown_unit as known_unit
from fish_env.data.vocabulary import CHANNELS, OBSERVATIONS


def shown_unit(name: str) -> tuple[str, float]:
    """Unit of a channel or observation, and how many of them make one SI unit.

    A table's turn radius is diagnosed as the curvature of the path.
    """
    return known_unit(name) if name in CHANNELS or name in OBSERVATIONS else ("1/m", 1.0)


def label(name: str) -> str:
    """Axis label with its unit."""
    return f"{name.replace('_', ' ')} ({shown_unit(name)[0]})"
