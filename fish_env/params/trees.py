"""Between parameter groups and nested plain data, keyed as in the YAML file."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from fish_env.params.fields import Leaf, join, parameter_fields
from fish_env.params.tables import CoefficientTable

AXES = "xyz"


def replaced_groups(fish: Any, values: Mapping[str, float]) -> dict[str, Any]:
    """Returns the top-level groups of a fish in which some numbers are replaced, by field name."""
    touched = {path.split(".", 1)[0] for path in values}
    return {name: replaced(getattr(fish, name), values, name) for name in touched}


def replaced(group: Any, values: Mapping[str, float], path: str) -> Any:
    """Returns a group with the numbers at the given full paths replaced."""
    changes: dict[str, Any] = {}
    for field in parameter_fields(group):
        old, here = getattr(group, field.name), join(path, field.name)
        if isinstance(old, CoefficientTable):
            continue
        if "section" in field.metadata:
            changes[field.name] = replaced(old, values, here)
        elif "axes" in field.metadata:
            items = (values.get(f"{here}[{i}]", item) for i, item in enumerate(old))
            changes[field.name] = tuple(items)
        else:
            changes[field.name] = values.get(here, old)
    return dataclasses.replace(group, **changes)


def to_plain(group: Any) -> dict[str, Any]:
    """Returns a group as nested dicts, lists and numbers; tables stay as they are."""
    return {field.name: plain(getattr(group, field.name)) for field in parameter_fields(group)}


def plain(value: Any) -> Any:
    """Returns one field's value as plain data; tables stay as they are."""
    if isinstance(value, CoefficientTable):
        return value
    if isinstance(value, tuple):
        return list(value)
    return to_plain(value) if dataclasses.is_dataclass(value) else value


def symbol_of(leaf: Leaf) -> str:
    """Returns the symbol of one number; of a vector declared by one symbol, with the axis."""
    if not leaf.path.endswith("]"):
        return leaf.spec.symbol
    index = int(leaf.path[-2])
    names = leaf.spec.symbol.split(", ")
    return names[index] if len(names) == len(AXES) else f"{names[0]}_{AXES[index]}"


def known_paths(cls: type[Any], path: str = "") -> set[str]:
    """Returns every path that a group's class declares: groups, vectors and single numbers."""
    paths: set[str] = set()
    for field in parameter_fields(cls):
        here = join(path, field.name)
        paths.add(here)
        paths.update(f"{here}[{index}]" for index in range(field.metadata.get("axes", 0)))
        if "section" in field.metadata:
            paths |= known_paths(field.metadata["section"], here)
    return paths
