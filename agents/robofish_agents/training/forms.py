"""Whether values of a checkpoint have the form that a training needs.

A checkpoint with a right checksum may still have been made by hand. What does not fit is refused
where it is read, and not met by the training that goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from fish_env.reading import is_number, shown


def check_form(value: Any, like: Any, place: str) -> None:
    """Refuses a value whose form is not that of another one.

    Mappings must have the same keys, lists the same length, arrays the same shape and kind of
    number. Infinite numbers and NaN may only be in arrays of which the other one has some.

    Args:
        value: plain values, see :mod:`robofish_agents.training.plain`.
        like: what has the form.
        place: names the value in the error.

    Raises:
        ValueError: names the first place that differs.
    """
    if isinstance(like, Mapping):
        _check(isinstance(value, Mapping) and set(value) == set(like), value, place)
        for key, one in like.items():
            check_form(value[key], one, f"{place}.{key}")
    elif isinstance(like, (list, tuple)):
        _check(isinstance(value, (list, tuple)) and len(value) == len(like), value, place)
        for i, (own, one) in enumerate(zip(value, like, strict=True)):
            check_form(own, one, f"{place}.{i}")
    elif isinstance(like, np.ndarray) and like.ndim:
        _check(_is_alike(value, like), value, place)
    elif like is None or isinstance(like, (bool, str)):
        _check(type(value) is type(like), value, place)
    else:
        _check(_is_scalar(value, isinstance(like, int)), value, place)


def observations_of(space: gym.Space[Any], count: int) -> np.ndarray:
    """An array of the form of a number of observations (count, ...)."""
    return np.zeros((count, *(space.shape or ())), space.dtype)


def _is_alike(value: Any, like: np.ndarray) -> bool:
    if not isinstance(value, np.ndarray) or value.shape != like.shape or value.dtype != like.dtype:
        return False
    return bool(np.isfinite(value).all() or not np.isfinite(like).all())


def _is_scalar(value: Any, whole: bool) -> bool:
    """Whether a value is one finite number, and a whole one where that is asked."""
    number = value.item() if isinstance(value, np.ndarray) and not value.ndim else value
    if whole:
        return isinstance(number, int) and not isinstance(number, bool)
    return isinstance(number, bool) or is_number(number)


def _check(fits: bool, value: Any, place: str) -> None:
    if not fits:
        kind = f"an array {value.shape}" if isinstance(value, np.ndarray) else shown(value)
        raise ValueError(f"{place}: {kind} does not fit")
