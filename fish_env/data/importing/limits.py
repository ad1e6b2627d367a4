"""How large a log may be, and a bound of memory for the libraries that read it.

A small file may unpack to gigabytes, and no setting of these libraries prevents it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from fish_env import reading
from fish_env.data.place import Place

try:
    import resource
except ImportError:  # Windows, which has no such limit
    resource = None  # type: ignore[assignment]

MOST_MEMORY = 4_000_000_000
"""Bytes that reading one log may take."""
MOST_FILE = 4_000_000_000
"""Bytes of a file that is unpacked into the temporary folder."""
MOST_VALUES = 100_000_000
"""Values of one log."""
MOST_CELLS = 20_000_000
"""Cells of one sheet, which take far more memory than numbers."""
MOST_COLUMNS = 10_000
LONGEST_NAME = 200
"""Characters of a column's name."""
MOST_RUNS = 1_000
"""Runs of one import."""
DEEPEST = reading.DEEPEST


def content(file: Path, most: int = reading.MOST_TABLE_BYTES) -> bytes:
    """Reads a whole file.

    Raises:
        DatasetError: It is a pipe or a device, is too large, or cannot be read.
    """
    try:
        return reading.read_bytes(file, most)
    except reading.Unreadable as error:
        raise Place(file).unreadable(error) from None


def check_is_file(file: Path) -> None:
    """Refuses pipes and devices, of which no end is known.

    Raises:
        DatasetError: It is one, or no file at all.
    """
    if not file.is_file():
        raise Place(file).refuse("it is no file: a pipe, a device or a folder", "Name a file")


def check_columns(count: int, place: Place) -> None:
    """Refuses a table of too many columns.

    Args:
        count: Its columns.
        place: The table, for the error.

    Raises:
        DatasetError: It has too many.
    """
    if count > MOST_COLUMNS:
        raise place.refuse(
            f"{count} columns, more than {MOST_COLUMNS}",
            "Save one row for each sample, and one column for each quantity",
        )


@contextmanager
def bounded() -> Iterator[None]:
    """Bounds the memory of this process, and the files it may write, while a library reads.

    What is beyond the bound raises `MemoryError` or `OSError`. Where the system has no such limit,
    as on Windows and macOS, nothing is bounded.
    """
    before: dict[int, Any] = {}
    with suppress(OSError, ValueError, AttributeError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        wanted = {
            resource.RLIMIT_AS: pages * resource.getpagesize() + MOST_MEMORY,
            resource.RLIMIT_FSIZE: MOST_FILE,
        }
        for kind, most in wanted.items():
            soft, hard = resource.getrlimit(kind)
            if soft == resource.RLIM_INFINITY or soft > most:
                resource.setrlimit(kind, (most, hard))
                before[kind] = (soft, hard)
    try:
        yield
    finally:
        for kind, limits in before.items():
            resource.setrlimit(kind, limits)
