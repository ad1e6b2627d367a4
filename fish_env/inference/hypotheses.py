"""Text form of parameters and causes, the only place that knows it.

An effect's parameter is written ``effects.<effect>.<parameter>``, a coefficient by its path in the
vehicle's parameter file, and a coefficient that is a cause of its own ``parameter:<path>``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

PREFIX = "effects."
PARAMETER = "parameter:"


def parameter_path(effect: str, parameter: str) -> str:
    """Path of a parameter of an effect."""
    return f"{PREFIX}{effect}.{parameter}"


def effect_of(path: str) -> str:
    """Name of the effect that an effect parameter belongs to."""
    return path.removeprefix(PREFIX).split(".")[0]


def parameter_of(path: str) -> str:
    """Name of an effect's parameter without the effect."""
    return path.removeprefix(PREFIX).split(".")[1]


def effects_of(paths: Iterable[str]) -> set[str]:
    """Names of the effects that some effect parameters belong to."""
    return {effect_of(path) for path in paths}


def of_effects(values: Mapping[str, float], effects: Collection[str]) -> dict[str, float]:
    """Those of effect parameters' values that belong to some effects."""
    return {path: value for path, value in values.items() if effect_of(path) in effects}
