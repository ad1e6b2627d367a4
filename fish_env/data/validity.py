"""Which commands the data behind an identified fish covered, and a warning far outside of them."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from fish_env.data.units import SI_UNIT
from fish_env.data.vocabulary import COMMANDS
from fish_env.params.schema import FishParams
from fish_env.reading import is_number

FAR = 0.25
"""How far beyond a range is far, as a share of the range and what lies between it and rest. By
hand: forces grow with the square of most commands, so that a quarter changes them by half."""


def covered(fish: FishParams) -> dict[str, tuple[float, float]]:
    """Lowest and highest value (SI) of each command and channel in the data behind a fish.

    Nothing of a fish that no identification wrote. Files of earlier versions name the ranges beside
    the runs; those that say nothing of a command say nothing here.
    """
    if fish.posterior is None:
        return {}
    known = fish.posterior.validity
    ranges = known.get("ranges", known)
    if not isinstance(ranges, Mapping):
        return {}
    return {
        str(name): (float(ends[0]), float(ends[1]))
        for name, ends in ranges.items()
        if _is_range(ends)
    }


def _is_range(ends: Any) -> bool:
    pair = isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) == 2
    return pair and all(map(is_number, ends))


def far_outside(fish: FishParams, asked: Mapping[str, tuple[float, float]]) -> list[str]:
    """What is asked of a fish far outside of the data behind it, in words, by command.

    Rest counts as covered: a still tail, a block in its middle.

    Args:
        fish: the fish.
        asked: lowest and highest value (SI) by command.
    """
    found, known = [], covered(fish)
    for name, (lowest, highest) in asked.items():
        if name not in known or name not in COMMANDS:
            continue
        low, high = min(known[name][0], 0.0), max(known[name][1], 0.0)
        room = FAR * (high - low) + 1e-9
        if lowest < low - room or highest > high + room:
            seen = f"{known[name][0]:.3g} to {known[name][1]:.3g}"
            unit = SI_UNIT[COMMANDS[name].dimension]
            found.append(f"{name} {lowest:.3g} to {highest:.3g} {unit} (data: {seen})")
    return found


def warn_far_outside(
    fish: FishParams, asked: Mapping[str, tuple[float, float]], remedy: str, stacklevel: int
) -> bool:
    """Warns where a fish is asked for commands far outside of the data behind it.

    Args:
        fish: the fish.
        asked: lowest and highest value (SI) by command.
        remedy: what to do, beside measuring more.
        stacklevel: of the warning, so that Python shows it once for each place that asks.

    Returns:
        Whether it warned.
    """
    found = far_outside(fish, asked)
    if found:
        warnings.warn(
            f"{fish.name} was identified from data that do not cover {'; '.join(found)}: {remedy}, "
            "or measure runs there and identify it again",
            stacklevel=stacklevel,
        )
    return bool(found)
