"""Where in a dataset something is wrong, and the error that says so."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from fish_env.errors import DatasetError
from fish_env.reading import Unreadable, printable, short

LONGEST_SHOWN = 120
"""Characters of a column's name or of a key in a message."""


@dataclass(frozen=True)
class Place:
    """A spot in a dataset's files.

    Attributes:
        file: The file.
        run: Id of the run, where there is one.
        row: Line of the file, counted from 1 as an editor does; the header is row 1.
        column: Name of the column.
        key: Path of the key in dataset.yaml.
    """

    file: Path
    run: str | None = None
    row: int | None = None
    column: str | None = None
    key: str | None = None

    def at(self, row: int | None = None, column: str | None = None) -> "Place":
        """Returns the same place, narrowed to a row, a column, or both."""
        return replace(self, row=row or self.row, column=column or self.column)

    def refuse(self, reason: str, remedy: str) -> DatasetError:
        """Words the error for this place; the caller raises it."""
        return DatasetError(printable(f"{self}: {reason}. {remedy}."))

    def unreadable(self, error: Unreadable, about: str = "") -> DatasetError:
        """Words the error of a file or path that cannot be read; the caller raises it.

        Args:
            error: Why.
            about: What comes before the reason.
        """
        return self.refuse(f"{about}{error.reason}", error.remedy.capitalize())

    def __str__(self) -> str:
        parts = [str(self.file)]
        parts += [f"run {self.run}"] if self.run is not None else []
        parts += [f"row {self.row}"] if self.row is not None else []
        parts += [f"column {short(self.column, LONGEST_SHOWN)}"] if self.column is not None else []
        parts += [f"key {short(self.key, LONGEST_SHOWN)}"] if self.key is not None else []
        return ", ".join(parts)


def closest(word: str, known: Iterable[str]) -> str:
    """Words a remedy: the known name most like `word`, or all of them."""
    names = list(known)
    close = get_close_matches(word, names, n=1)
    return f"Perhaps '{close[0]}' is meant" if close else f"Use one of: {', '.join(names)}"
