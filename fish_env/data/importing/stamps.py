"""Time columns of a log: from any unit to whole nanoseconds, and a guess of the unit."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fish_env.arrays import BoolArray, IntArray
from fish_env.data.clock import SLOW, SLOWEST, iso_seconds
from fish_env.data.declared import ISO
from fish_env.data.importing.source import Source
from fish_env.data.place import Place
from fish_env.data.units import parse_unit
from fish_env.data.vocabulary import Quantity
from fish_env.errors import DatasetError

Nanoseconds = IntArray

EPOCH_NS = 10**17
"""ns, about three years. A later time counts from a date."""
LATEST_NS = 9e18
"""ns. 64 bits hold 9.22e18."""
MOST_REPEATED = 0.02
"""Share of the stamps that may repeat the one before, beyond which the clock is too coarse."""
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))
_STEPS = ((1.0, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns"))
_DURATION = Quantity("time")


@dataclass(frozen=True)
class TimeColumn:
    """How the times of a source are to be read.

    Attributes:
        column: Name of the column.
        unit: Its unit, or "iso".
        offset_s: Added to its times, s, to bring it onto the clock of the other sources.
    """

    column: str
    unit: str
    offset_s: float = 0.0


@dataclass(frozen=True)
class Stamps:
    """Times of a source's rows.

    Attributes:
        ns: Times in order, shape (m,), increasing.
        rows: The row of the source of each, shape (m,).
        notes: What was sorted or left out.
    """

    ns: Nanoseconds
    rows: NDArray[np.intp]
    notes: tuple[str, ...] = ()


def read_stamps(source: Source, time: TimeColumn) -> Stamps:
    """Reads the times of a source.

    Rows without anything in them have no time. Messages are put in the order of their stamps;
    of rows with one stamp the first is kept. Either is noted.

    Args:
        source: The table.
        time: Its time column.

    Raises:
        DatasetError: A time is missing or none, the rows of a file are out of order, or the clock
            is so coarse that many rows share a stamp.
    """
    ns, present = _to_ns(source, time)
    rows, notes = np.flatnonzero(present), list[str]()
    ns = _shifted(ns[rows], time.offset_s, source.place(time.column))
    backward = np.flatnonzero(np.diff(ns) < 0)
    if backward.size and source.kind == "":
        raise source.place(time.column, int(rows[backward[0] + 1])).refuse(
            "time does not increase",
            "Sort the rows; if several runs follow each other, name the "
            "column that separates them: --run-column",
        )
    if backward.size:
        notes.append(f"{source.name}: {backward.size} messages put in the order of their stamps")
        order = np.argsort(ns, kind="stable")
        ns, rows = ns[order], rows[order]
    first = np.r_[True, np.diff(ns) > 0]
    if not first.all():
        repeated = int((~first).sum())
        if repeated > MOST_REPEATED * len(ns):
            raise source.place(time.column).refuse(
                f"{repeated} of {len(ns)} rows have the time of the row before",
                "Map a finer clock, or remove repeated rows",
            )
        notes.append(f"{source.name}: {repeated} rows left out, which repeat the time before them")
    return Stamps(ns[first], rows[first], tuple(notes))


def _to_ns(source: Source, time: TimeColumn) -> tuple[Nanoseconds, BoolArray]:
    """Times of all rows, and which rows hold anything at all."""
    place = source.place(time.column)
    values = source.column(time.column)
    if time.unit.lower() == ISO:
        return _from_text(source, time.column)
    factor = parse_unit(time.unit, _DURATION, place).factor * 1e9
    if values.dtype == np.int64 and factor >= 1.0:
        # As Python's number, since the size of the smallest int64 is none.
        largest = max(abs(int(values.min(initial=0))), abs(int(values.max(initial=0))))
        _check_date(largest, time.unit, factor, place)
        return values * round(factor), np.ones(len(values), bool)
    numbers = source.numbers(time.column)
    missing = ~np.isfinite(numbers)
    empty = missing & _is_empty(source)
    if (missing & ~empty).any():
        index = int(np.argmax(missing & ~empty))
        raise source.place(time.column, index).refuse("the time is missing", "Fill it in")
    whole = np.floor(np.where(missing, 0.0, numbers))
    part = np.where(missing, 0.0, numbers) - whole
    _check_date(float(np.abs(whole).max(initial=0.0)), time.unit, factor, place)
    if factor >= 1.0 and float(factor).is_integer():
        return whole.astype(np.int64) * int(factor) + np.rint(part * factor).astype(
            np.int64
        ), ~empty
    return np.rint((whole + part) * factor).astype(np.int64), ~empty


def _check_date(largest: float, unit: str, factor: float, place: Place) -> None:
    """Refuses a time that nanoseconds in 64 bits cannot hold."""
    if largest * factor > LATEST_NS:
        raise place.refuse(
            f"{largest:.6g} {unit} is not a plausible date", "Correct the unit of time"
        )


def _shifted(ns: Nanoseconds, offset_s: float, place: Place) -> Nanoseconds:
    """Times on the clock of the other sources."""
    if not abs(offset_s) * 1e9 <= LATEST_NS / 2 or np.abs(ns).max(initial=0) > LATEST_NS / 2:
        if offset_s == 0.0:
            return ns
        raise place.refuse(
            f"an offset of {offset_s:g} s leads to no plausible date", "Correct the offset"
        )
    return ns + round(offset_s * 1e9)


def _is_empty(source: Source) -> BoolArray:
    empty = np.ones(len(source), bool)
    for values in source.columns.values():
        if values.dtype == object:
            empty &= np.array([not cell for cell in values], dtype=bool)
        else:
            empty &= np.isnan(values.astype(np.float64))
    return empty


def _from_text(source: Source, column: str) -> tuple[Nanoseconds, BoolArray]:
    cells = source.column(column)
    present = np.array([bool(str(cell)) for cell in cells], dtype=bool)
    ns, kinds = np.zeros(len(cells), np.int64), set[str]()
    for index in np.flatnonzero(present):
        since, kind = iso_seconds(_iso(str(cells[index])), source.place(column, int(index)))
        kinds.add(kind)
        ns[index] = round(since.total_seconds() * 1e6) * 1000
    if len(kinds) > 1:
        raise source.place(column).refuse(
            f"some stamps have {' and some '.join(sorted(kinds))}", "Write all stamps alike"
        )
    return ns, present


def _iso(cell: str) -> str:
    """A stamp with a decimal comma, which ISO 8601 allows, or slashes between year and day."""
    return re.sub(r"^(\d{4})/(\d{2})/(\d{2})", r"\1-\2-\3", cell).replace(",", ".")


def guess_unit(source: Source, column: str) -> tuple[str, str] | None:
    """Guesses the unit of a time column, from its values where its name does not say it.

    Args:
        source: The table.
        column: Name of the column.

    Returns:
        The unit, and in words how it was found; None if the column holds no times.
    """
    if not source.is_numeric(column):
        cell = next((str(cell) for cell in source.columns[column] if str(cell)), "")
        try:
            iso_seconds(_iso(cell), Place(source.file))
        except DatasetError:
            return None
        return ISO, "dates or times of day as text"
    values = source.columns[column].astype(np.float64)
    values = values[np.isfinite(values)]
    if len(values) < 2:
        return None
    size = float(np.median(np.abs(values)))
    step = float(np.median(np.abs(np.diff(values))))
    for (least, unit), (length, _) in zip(_EPOCHS, reversed(_STEPS), strict=True):
        if size >= least and step / length <= SLOWEST:
            return unit, f"values near {size:.3g} count from 1970 in {unit}"
    unit = next((unit for length, unit in _STEPS if step / length <= SLOW), "ns")
    return unit, f"a usual step of {step:.4g} between samples"
