"""What the tests run as tasks; machines of a cluster import it by name."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import NamedTuple

from fish_env.errors import DatasetError


class Asked(NamedTuple):
    """A number to square, and a folder where each attempt leaves a file."""

    number: int
    folder: str
    seconds: float = 0.0


def attempts(folder: Path, number: int) -> int:
    return len(list(Path(folder).glob(f"{number}-*")))


def square(asked: Asked) -> int:
    """Squares after a while."""
    mark = f"{asked.number}-{os.getpid()}-{time.monotonic_ns()}"
    (Path(asked.folder) / mark).touch()
    time.sleep(asked.seconds)
    return asked.number**2


def dies_once(asked: Asked) -> int:
    """Kills its process on the first attempt."""
    result = square(asked)
    if attempts(Path(asked.folder), asked.number) == 1:
        os._exit(1)
    return result


def dies_always_at_three(asked: Asked) -> int:
    """Kills its process whenever the number is three."""
    result = square(asked)
    if asked.number == 3:
        os._exit(1)
    return result


def refuses_three(asked: Asked) -> int:
    """Raises an error that a user could meet."""
    result = square(asked)
    if asked.number == 3:
        raise DatasetError("three: is no data set;\n drop it")
    return result
