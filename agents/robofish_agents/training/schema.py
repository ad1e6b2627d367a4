"""Builds frozen dataclasses from a YAML tree, strictly: a wrong key or type names its place."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from fish_env.errors import ConfigError
from fish_env.reading import is_number, short, shown

T = TypeVar("T")


def build(cls: type[T], tree: Any, place: str) -> T:
    """Builds a dataclass from a mapping of its fields.

    Args:
        cls: a dataclass of numbers, texts, tuples of them, mappings and further dataclasses.
        tree: what a YAML file says.
        place: file and key, for error messages.

    Raises:
        ConfigError: an unknown or missing key, a wrong type, or what the class itself refuses.
    """
    assert dataclasses.is_dataclass(cls)
    known = {field.name: field for field in dataclasses.fields(cls)}
    if not isinstance(tree, Mapping):
        raise ConfigError(f"{place}: must be a mapping with {', '.join(known)}")
    for key in tree:
        if key not in known:
            raise ConfigError(
                f"{place}: unknown key '{short(str(key))}'; known here: {', '.join(known)}"
            )
    hints = get_type_hints(cls)
    values: dict[str, Any] = {}
    for name, field in known.items():
        if name in tree:
            values[name] = _value(hints[name], tree[name], f"{place}: {name}")
        elif field.default is field.default_factory is dataclasses.MISSING:
            raise ConfigError(f"{place}: key '{name}' is missing")
    try:
        return cls(**values)
    except ConfigError as error:
        raise ConfigError(f"{place}: {error}") from None


def _value(hint: Any, value: Any, place: str) -> Any:
    if dataclasses.is_dataclass(hint):
        return build(hint, value, place)  # type: ignore[arg-type]
    kinds = get_args(hint)
    if type(None) in kinds:
        (inner,) = (kind for kind in kinds if kind is not type(None))
        return None if value is None else _value(inner, value, place)
    if get_origin(hint) is tuple:
        if not isinstance(value, (list, tuple)):
            raise ConfigError(f"{place} must be a list, got {shown(value)}")
        return tuple(_value(kinds[0], item, place) for item in value)
    if get_origin(hint) is Mapping:
        if not isinstance(value, Mapping):
            raise ConfigError(f"{place} must be a mapping, got {shown(value)}")
        return dict(value)
    return _scalar(hint, value, place)


def _scalar(kind: type, value: Any, place: str) -> Any:
    if kind is float and is_number(value):
        return float(value)
    whole = isinstance(value, float) and value.is_integer()
    if kind is int and is_number(value) and (isinstance(value, int) or whole):
        return int(value)
    if kind in (bool, str) and isinstance(value, kind):
        return value
    names = {float: "a finite number", int: "a whole number", bool: "true or false", str: "a text"}
    raise ConfigError(f"{place} must be {names[kind]}, got {shown(value)}")
