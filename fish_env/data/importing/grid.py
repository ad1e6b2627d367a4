"""Rows of cells, of a text file or of a sheet, turned into named columns."""

import re
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, date, datetime, time, timedelta
from typing import Any

import numpy as np

from fish_env.data.importing import limits
from fish_env.data.importing.source import Values
from fish_env.data.place import Place
from fish_env.data.units import unit_root

Row = Sequence[Any]

LATEST_HEADER = 50
"""Rows among which the header is looked for; a preamble may stand above it."""
_MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--", "#n/a")
_LONG = re.compile(r"[+-]?\d{16,18}|1\d{18}")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def columns_of(
    rows: Sequence[Row], place: Place, comma: bool = False
) -> tuple[dict[str, Values], dict[str, str], int]:
    """Finds the header, the row of units below it if there is one, and the columns.

    Args:
        rows: Cells: text, numbers, dates or None.
        place: The file and sheet.
        comma: Whether numbers have a decimal comma.

    Returns:
        Values by column name; units by column name; and the index of the first row of values.

    Raises:
        DatasetError: There are no rows of values, or two columns have one name.
    """
    header = find_header(rows, comma)
    if header is None:
        width = max((len(row) for row in rows), default=0)
        names, first, units = [f"column {i + 1}" for i in range(width)], 0, dict[str, str]()
    else:
        names = [_label(cell) for cell in rows[header]]
        names = [name or f"column {i + 1}" for i, name in enumerate(names)]
        units = _units_row(names, rows[header + 1]) if len(rows) > header + 1 else {}
        first = header + (2 if units else 1)
    limits.check_columns(len(names), place)
    body = list(rows[first:])
    while body and not any(_label(cell) for cell in body[-1]):
        body.pop()
    if len(body) < 2:
        raise place.refuse(
            f"{len(body)} rows of values", "Give a header and at least two rows below it"
        )
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise place.at(column=twice).refuse("two columns have this name", "Rename one of them")
    _check_widths(body, len(names), first, place)
    return (
        {name: _values([_cell(row, i) for row in body], comma) for i, name in enumerate(names)},
        units,
        first,
    )


def _cell(row: Row, index: int) -> Any:
    return row[index] if index < len(row) else None


def _check_widths(body: Sequence[Row], width: int, first: int, place: Place) -> None:
    for index, row in enumerate(body):
        if any(_label(cell) for cell in row[width:]):
            raise place.at(first + index + 1).refuse(
                f"{len(row)} cells under a header of {width}", "Give every column a name"
            )


def find_header(rows: Sequence[Row], comma: bool) -> int | None:
    """Index of the row of names: the last one of mere text above the first row of numbers.

    Args:
        rows: The cells.
        comma: Whether numbers have a decimal comma.

    Returns:
        None if the rows begin with values.
    """
    for index, row in enumerate(rows[:LATEST_HEADER]):
        filled = [cell for cell in row if _label(cell)]
        if filled and sum(_parse(cell, comma) is not None for cell in filled) * 2 > len(filled):
            above = [
                i
                for i in range(index)
                if len([c for c in rows[i] if _label(c)]) > 1
                or (len(filled) == 1 and any(_label(c) for c in rows[i]))
            ]
            if not above:
                return None
            last = above[-1]
            return above[-2] if len(above) > 1 and _is_units(rows[last]) else last
    return 0 if rows else None


def _is_units(row: Row) -> bool:
    cells = [_label(cell).strip("[]()") for cell in row]
    filled = [cell for cell in cells if cell not in ("", "-")]
    return bool(filled) and all(unit_root(cell) is not None for cell in filled)


def _units_row(names: list[str], row: Row) -> dict[str, str]:
    """Units by column, if the row below the header holds nothing else."""
    if not _is_units(row) or all(_parse(cell, False) is not None for cell in row if _label(cell)):
        return {}
    cells = [_label(cell).strip("[]()") for cell in row]
    return {name: unit for name, unit in zip(names, cells, strict=False) if unit not in ("", "-")}


def _label(cell: Any) -> str:
    return "" if cell is None else str(cell).strip()


def _parse(cell: Any, comma: bool) -> float | int | None:
    """A number, or None where the cell holds text; dates are nanoseconds."""
    if isinstance(cell, int | float):
        return cell
    if isinstance(cell, datetime):
        since = cell - datetime(1970, 1, 1, tzinfo=UTC if cell.tzinfo else None)
        return since // timedelta(microseconds=1) * 1000
    if isinstance(cell, date | time):
        return None
    text = _label(cell)
    if text.lower() in _MISSING:
        return float("nan")
    if comma and _DECIMAL_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    if "_" in text:
        return None
    try:
        return int(text) if _LONG.fullmatch(text) else float(text)
    except ValueError:
        return None


def _values(cells: list[Any], comma: bool) -> Values:
    """Numbers where every cell is one, else the text of the cells."""
    parsed = [_parse(cell, comma) for cell in cells]
    if any(value is None for value in parsed):
        return np.array([_label(cell) for cell in cells], dtype=object)
    if all(isinstance(value, int) and not isinstance(value, bool) for value in parsed):
        return np.array(parsed, dtype=np.int64)
    return np.array(parsed, dtype=np.float64)
