"""One CSV file, read so that every wrong cell can be named by its row."""

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fish_env import reading
from fish_env.arrays import FloatArray
from fish_env.data.place import Place, closest

MOST_COLUMNS = 1000
NAN = ("nan", "+nan", "-nan")


@dataclass(frozen=True)
class Column:
    """The column of a quantity.

    Attributes:
        name: Name of the column in the file.
        factor: What its cells are multiplied by to be in the declared unit: sign times scale.
        frame: "ned" or "enu", the frame its values are in.
        offset: What is added then, in the declared unit.
    """

    name: str
    factor: float
    frame: str
    offset: float = 0.0


@dataclass(frozen=True)
class Table:
    """The cells of a CSV file.

    Attributes:
        place: The file, and the run that it holds.
        rows: Line of the file of each row of cells.
        cells: Cells by column name: their text, or numbers where they are no file's.
        columns: Where each quantity stands; a quantity without an entry has a column of its name.
    """

    place: Place
    rows: list[int]
    cells: Mapping[str, Sequence[str] | FloatArray]
    columns: Mapping[str, Column] = field(default_factory=dict)

    def label(self, name: str) -> str:
        """Name of the column in which a quantity stands."""
        return self.columns[name].name if name in self.columns else name

    def at(self, name: str, row: int | None = None) -> Place:
        """Returns the place of a quantity's column, in one row if that is given."""
        return self.place.at(row, self.label(name))

    def require(self, names: list[str]) -> None:
        """Refuses the table unless it has the columns of all these quantities.

        Raises:
            DatasetError: Naming the first column that is missing.
        """
        for name in names:
            if self.label(name) not in self.cells:
                raise self.at(name, 1).refuse(
                    "the column is declared in dataset.yaml but is not in the file",
                    f"Add it, or declare what is there ({', '.join(self.cells)})",
                )

    def numbers(self, name: str, may_miss: bool = True) -> FloatArray:
        """Returns a quantity in its declared unit, NaN where the cell is empty or says nan.

        Args:
            name: The quantity.
            may_miss: Whether cells may be empty.

        Raises:
            DatasetError: At the first cell that is no number, infinite, or missing.
        """
        cells = self.cells[self.label(name)]
        values = (
            cells if isinstance(cells, np.ndarray) else np.array([_number(cell) for cell in cells])
        )
        if np.isinf(values).any():
            self._refuse_cell(name, int(np.argmax(np.isinf(values))))
        if not may_miss and np.isnan(values).any():
            row = self.rows[int(np.argmax(np.isnan(values)))]
            raise self.at(name, row).refuse("the cell is empty", "Fill it in")
        # Adding zero turns the -0.0 of a reversed zero into 0.0.
        column = self.columns.get(name, Column(name, 1.0, "ned"))
        return column.factor * values + (column.offset + 0.0)

    def _refuse_cell(self, name: str, index: int) -> None:
        cell = self.cells[self.label(name)][index]
        raise self.at(name, self.rows[index]).refuse(
            f"'{reading.short(str(cell))}' is not a finite number",
            "Write a plain number with a decimal point, or leave the cell empty "
            "where a sample is missing",
        )

    def text(self, column: str) -> tuple[str, ...]:
        """Returns a column of text, without the spaces around it.

        Raises:
            DatasetError: At the first empty cell.
        """
        cells = tuple(str(cell).strip() for cell in self.cells[column])
        for row, cell in zip(self.rows, cells, strict=True):
            if not cell:
                raise self.place.at(row, column).refuse("the cell is empty", "Fill it in")
            if not cell.isprintable():
                raise self.place.at(row, column).refuse(
                    f"{reading.shown(cell)} has a control character", "Write it without"
                )
        return cells


def _number(cell: str) -> float:
    if not cell or cell.isspace():
        return math.nan
    value = reading.plain_number(cell)
    # What is no number counts as infinite, which is refused.
    return math.inf if math.isnan(value) and cell.strip().lower() not in NAN else value


def read_table(place: Place, fewest_rows: int) -> Table:
    """Reads a CSV file: one header row, then rows of as many cells.

    Empty lines at the end of the file are no rows.

    Args:
        place: The file, and the run that it holds.
        fewest_rows: How many rows below the header it must have.

    Raises:
        DatasetError: The file is missing, unreadable, too short, or a row has the wrong
            number of cells.
    """
    lines = _read_lines(place)
    if not lines:
        raise place.refuse("the file is empty", "Give a header row and the rows below it")
    names = [name.strip() for name in lines[0][1]]
    _check_header(place, names)
    body = lines[1:]
    for row, cells in body:
        if len(cells) != len(names):
            raise place.at(row).refuse(
                f"{len(cells)} cells under a header of {len(names)}",
                "Give every row one cell a column, separated by commas",
            )
    if len(body) < fewest_rows:
        raise place.refuse(
            f"{len(body)} rows below the header, where at least {fewest_rows} are needed",
            "Give more rows, or leave the file out",
        )
    columns = zip(*(cells for _, cells in body), strict=True)
    return Table(place, [row for row, _ in body], dict(zip(names, columns, strict=True)))


def _read_lines(place: Place) -> list[tuple[int, list[str]]]:
    reader = csv.reader(
        io.StringIO(read_text(place, reading.MOST_TABLE_BYTES), newline=""), strict=True
    )
    try:
        lines = [(reader.line_num, cells) for cells in reader]
    except csv.Error as error:
        raise place.at(reader.line_num).refuse(
            f"this is not a CSV row ({error})", "Check its quotation marks"
        ) from error
    while lines and _is_blank(lines[-1][1]):
        lines.pop()
    return lines


def _is_blank(cells: list[str]) -> bool:
    return not cells or (len(cells) == 1 and not cells[0].strip())


def _check_header(place: Place, names: list[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise place.at(1).refuse(
            f"{len(names)} columns, more than {MOST_COLUMNS}",
            "Give one row per sample and one column per quantity",
        )
    for name, count in Counter(names).items():
        if count > 1:
            raise place.at(1, name).refuse("two columns have this name", "Rename one of them")


def read_text(place: Place, most: int = reading.MOST_TEXT_BYTES) -> str:
    """Reads a UTF-8 file.

    Args:
        place: The file.
        most: Bytes from which it is refused.

    Raises:
        DatasetError: It is missing, unreadable or no text.
    """
    try:
        return reading.read_text(place.file, most)
    except FileNotFoundError as error:
        beside = [path.name for path in _neighbours(place.file)]
        raise place.refuse(
            "there is no such file",
            closest(place.file.name, beside) if beside else "Check the path",
        ) from error
    except reading.Unreadable as error:
        raise place.unreadable(error, "it ") from error


def _neighbours(path: Path) -> list[Path]:
    return sorted(path.parent.glob(f"*{path.suffix}"))[:20] if path.parent.is_dir() else []
