"""Independent fits at once: one computes in Python while another one's runs are filtered."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from fish_env.model.runtime import default_threads

T = TypeVar("T")


def side_by_side(tasks: Iterable[Callable[[], T]]) -> list[T]:
    """Results of tasks that do not depend on each other, in their order.

    The threads are not those of the filter, on which the tasks wait.
    """
    with ThreadPoolExecutor(default_threads(), thread_name_prefix="fit") as pool:
        return list(pool.map(lambda task: task(), tasks))
