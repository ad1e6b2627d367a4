"""Independent fits at once: one computes in Python while another one's runs are filtered."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar, cast

from fish_env.threads import default_threads

T = TypeVar("T")
A = TypeVar("A")
B = TypeVar("B")


def side_by_side(tasks: Iterable[Callable[[], T]]) -> list[T]:
    """Results of tasks that do not depend on each other, in their order.

    The threads are not those of the filter, on which the tasks wait.
    """
    with ThreadPoolExecutor(default_threads(), thread_name_prefix="fit") as pool:
        return list(pool.map(lambda task: task(), tasks))


def both(one: Callable[[], A], other: Callable[[], B]) -> tuple[A, B]:
    """Results of two tasks that do not depend on each other."""
    tasks: tuple[Callable[[], A | B], ...] = (one, other)
    first, second = side_by_side(tasks)
    return cast(A, first), cast(B, second)
