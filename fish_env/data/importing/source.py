"""Tables of a log as they were found, before anybody says what their columns mean."""

import errno
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fish_env.arrays import BoolArray, FloatArray
from fish_env.data.place import Place, closest
from fish_env.errors import DatasetError, MissingExtraError
from fish_env.reading import plain_number, printable, shown

_FULL = (errno.EFBIG, errno.ENOSPC, errno.EDQUOT, errno.ENOMEM)
Values = NDArray[Any]
"""A column: float64, int64, or text as objects."""


@dataclass(frozen=True)
class Source:
    """One table of a log.

    Attributes:
        file: The file, or the folder of a bag.
        part: Topic, sheet or variable; empty where the file is one table.
        columns: Values by column name, all of one length.
        units: Units that the file itself states, by column name.
        kind: Message type of a topic; empty otherwise.
        frame_id: What `header.frame_id` of a topic says; empty otherwise.
        first_row: Line of the file of the first row; 0 where rows have no line.
    """

    file: Path
    part: str
    columns: Mapping[str, Values]
    units: Mapping[str, str] = field(default_factory=dict)
    kind: str = ""
    frame_id: str = ""
    first_row: int = 0

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    @property
    def name(self) -> str:
        """File and part, for people."""
        return f"{self.file.name} {self.part}".strip()

    def place(self, column: str | None = None, index: int | None = None) -> Place:
        """Place of a column, in one row if its index is given."""
        row = None if index is None or not self.first_row else self.first_row + index
        shown = f"{self.part} {column or ''}".strip() or None
        return Place(self.file, row=row, column=shown)

    def column(self, name: str) -> Values:
        """Returns a column as it is.

        Raises:
            DatasetError: There is none of that name.
        """
        if name not in self.columns:
            raise self.place(name).refuse("there is no such column", closest(name, self.columns))
        return self.columns[name]

    def numbers(self, name: str) -> FloatArray:
        """Returns a column as numbers, NaN where missing.

        Raises:
            DatasetError: There is none of that name, or a cell holds text.
        """
        values = self.column(name)
        if values.dtype != object:
            return values.astype(np.float64)
        for index, cell in enumerate(values):
            if not is_number(cell):
                raise self.place(name, index).refuse(
                    f"{shown(str(cell))} is not a number", "Correct the cell, or map another column"
                )
        return np.array([np.nan if not str(cell).strip() else float(cell) for cell in values])

    def is_numeric(self, name: str) -> bool:
        """Whether a column holds numbers."""
        return bool(self.columns[name].dtype != object)

    def rows(self, chosen: BoolArray) -> "Source":
        """The same table with some of its rows, which then have no line of the file."""
        columns = {name: values[chosen] for name, values in self.columns.items()}
        return Source(self.file, self.part, columns, self.units, self.kind, self.frame_id)


def is_number(cell: object) -> bool:
    """Whether a cell is empty or holds a number."""
    text = str(cell).strip()
    return not text or text.lower() == "nan" or not math.isnan(plain_number(text))


@contextmanager
def reading(file: Path, what: str) -> Iterator[None]:
    """Words whatever a reading library raises as one error of ours.

    Args:
        file: The file that is read.
        what: What it should be, as "a ROS bag".

    Raises:
        DatasetError: The library could not read it.
    """
    try:
        yield
    except (DatasetError, MissingExtraError):
        raise
    except FileNotFoundError as error:
        raise Place(file).refuse(f"it cannot be read: {_reason(error)}", "Check the path") from None
    # Parsers of foreign formats raise errors of many kinds on broken files.
    except Exception as error:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) in _FULL:
            raise Place(file).refuse(
                "reading it takes too much memory, or room in the temporary folder",
                "Cut it into runs, or leave columns out",
            ) from error
        raise Place(file).refuse(
            f"this cannot be read as {what} ({_reason(error)})",
            "Check that it is whole and of the kind its ending says",
        ) from error


def _reason(error: Exception) -> str:
    words = printable(str(error)[:1000])[:200]
    return f"{type(error).__name__}: {words}".rstrip(": ")
