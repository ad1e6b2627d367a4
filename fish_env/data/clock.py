"""The time column of a run: its unit, its order, and refusal of what cannot be seconds."""

from datetime import UTC, datetime, timedelta
from datetime import time as time_of_day

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.declared import TIME, Clock
from fish_env.data.place import Place
from fish_env.data.schema import Dataset
from fish_env.data.table import Table
from fish_env.data.vocabulary import COMMANDS
from fish_env.errors import DatasetError

EPOCH_S = 1e8
"""s, about three years. No run lasts so long, so a later time counts from a date."""

LONGEST_S = 1e6
"""s, twelve days. No run lasts so long."""

SLOW, SLOWER = 0.5, 1.5
"""s. Median sample intervals from which a clock is asked for its unit: beyond the second always,
beyond the first if the tail beats so fast that nobody would sample it so slowly."""

FEWEST = 5
"""Samples from which the interval between them is judged."""

SLOWEST = 5.0
"""s. A fish whose motion is sampled less often than this cannot be compared with a simulation."""

QUICKEST = 1e-4
"""s. Mean sample interval below which a clock cannot be in its unit: 10,000 rows a second. A mean,
because rows of several sensors may come in bursts."""

USUAL = 1e-3
"""s. Sample intervals from here up to :data:`SLOW` are usual."""

DATES_S = (6.3e8, 4.1e9)
"""s since 1970: 1990 to 2100."""

_LARGER = (("ms", 1e3), ("us", 1e6), ("ns", 1e9))


def read_time(table: Table, clock: Clock) -> tuple[FloatArray, tuple[str, ...]]:
    """Reads the time column, shape (n,), s, and a note if it is made to begin at 0.

    A clock that counts from a date, as epoch stamps do, loses its digits in a float. Such a time
    is counted from the first sample.

    Raises:
        DatasetError: A time is missing, no time, or not later than the one before.
    """
    place = table.at(TIME)
    if clock.unit is None:
        time, begins = _from_text(table), 0.0
    else:
        time, begins = _from_numbers(table, clock.unit.factor)
    _check_order(time + begins, table)
    if clock.unit is None:
        first = table.text(clock.column)[0]
        return time, (f"{place}: the run begins at t = 0, which is {first}",)
    if begins:
        stamp = _date(begins, clock, table)
        return time, (f"{place}: the run begins at t = 0, which is {stamp} if 1970 is 0",)
    return time, ()


def _from_numbers(table: Table, factor: float) -> tuple[FloatArray, float]:
    """Times, s, and what was taken off them, s."""
    time = table.numbers(TIME, may_miss=False)
    if abs(time[0]) * factor < EPOCH_S:
        return time * factor, 0.0
    cells = table.cells[table.label(TIME)]
    if not isinstance(cells, np.ndarray) and all(cell.strip().isdigit() for cell in cells):
        # Whole numbers of 19 digits, nanoseconds since 1970, do not fit a float.
        first = int(cells[0])
        return np.array([float(int(cell) - first) for cell in cells]) * factor, first * factor
    return (time - time[0]) * factor, float(time[0] * factor)


def _date(begins: float, clock: Clock, table: Table) -> str:
    """A time since 1970, s, as a date."""
    try:
        return datetime.fromtimestamp(begins, UTC).isoformat(timespec="milliseconds")
    except (ValueError, OverflowError, OSError):
        place, reason = table.at(TIME, table.rows[0]), f"{begins:.4g} s is not a date"
        unit = _unit_of_stamp(begins, clock)
        if unit is None:
            raise place.refuse(reason, "Correct the time or its unit") from None
        raise place.refuse(
            f"{reason}; it looks like {unit} since 1970", _declare(clock, unit)
        ) from None


def _unit_of_stamp(begins: float, clock: Clock) -> str | None:
    """Unit in which a stamp, read as a time in s since 1970, is a date of our time."""
    factor = clock.unit.factor if clock.unit is not None else 1.0
    for unit, size in _LARGER:
        if DATES_S[0] < begins / factor / size < DATES_S[1]:
            return unit
    return None


def _declare(clock: Clock, unit: str) -> str:
    """The remedy for a clock that is in another unit than it was read in."""
    return f"Declare its unit in dataset.yaml: `time: {{column: {clock.column}, unit: {unit}}}`"


def _from_text(table: Table) -> FloatArray:
    cells = table.text(table.label(TIME))
    stamps = [
        iso_seconds(cell, table.at(TIME, row)) for cell, row in zip(cells, table.rows, strict=True)
    ]
    kinds = {stamp[1] for stamp in stamps}
    if len(kinds) > 1:
        raise table.at(TIME).refuse(
            f"some stamps have {' and some '.join(sorted(kinds))}", "Write all stamps alike"
        )
    return np.array([(stamp - stamps[0][0]).total_seconds() for stamp, _ in stamps])


def iso_seconds(cell: str, place: Place) -> tuple[timedelta, str]:
    """Reads one ISO 8601 stamp, a date with a time or a time of day.

    Args:
        cell: The text.
        place: Where it stands.

    Returns:
        The time since 1970, UTC where a zone is given, or since midnight; and its kind in words.

    Raises:
        DatasetError: It is no such stamp.
    """
    try:
        stamp = datetime.fromisoformat(cell)
    except ValueError:
        return _since_midnight(cell, place), "a time of day without a date"
    if stamp.tzinfo is None:
        return stamp - datetime(1970, 1, 1), "a date without a time zone"
    return stamp - datetime(1970, 1, 1, tzinfo=UTC), "a date with a time zone"


def _since_midnight(cell: str, place: Place) -> timedelta:
    try:
        of_day = time_of_day.fromisoformat(cell)
    except ValueError:
        raise place.refuse(
            f"'{cell}' is not a time in ISO 8601", "Write it as 2026-05-01T12:00:00.040"
        ) from None
    midnight = datetime.min.replace(tzinfo=of_day.tzinfo)
    return datetime.combine(midnight, of_day) - midnight


def _check_order(time: FloatArray, table: Table) -> None:
    backward = np.flatnonzero(np.diff(time) <= 0.0)
    if backward.size:
        before, after = time[backward[0]], time[backward[0] + 1]
        raise table.at(TIME, table.rows[backward[0] + 1]).refuse(
            f"time does not increase: {after:.9g} s comes after {before:.9g} s",
            "Sort the rows or remove the repeated one; if the clock was set back, correct it or "
            "make two runs of it",
        )


def check_clock(time: FloatArray, commands: FloatArray, clock: Clock, table: Table) -> None:
    """Refuses a clock that can hardly be in its unit.

    Args:
        time: Sample times as read, shape (n,), s.
        commands: Commands of each row, shape (n, 5), SI.
        clock: The time column; one whose unit is declared may be as slow as it likes.
        table: The file and run.

    Raises:
        DatasetError: The samples are too close for any log, or too far apart for seconds.
    """
    _check_quickest(time, clock, table)
    if clock.declared or time.size < FEWEST:
        _check_span(time, table)
        return
    interval = float(np.median(np.diff(time)))
    if interval < SLOW or (interval < SLOWER and _beats(commands) * interval < SLOW):
        _check_span(time, table)
        return
    unit, counts = _likely_unit(interval), bool(np.all(np.diff(time) == 1.0))
    raise table.at(TIME).refuse(
        f"the samples are {interval:.4g} s apart (median) if this clock is in seconds; "
        f"it looks like {unit}{' or like a count of the rows' if counts else ''}",
        f"{_declare(clock, unit)}, or `unit: s` if it is in seconds"
        f"{', or divide a count by the number of rows a second' if counts else ''}",
    )


def _check_quickest(time: FloatArray, clock: Clock, table: Table) -> None:
    interval = float(time[-1] - time[0]) / (time.size - 1)
    if clock.unit is None or time.size < FEWEST or interval >= QUICKEST:
        return
    raise table.at(TIME).refuse(
        f"the samples are {interval:.4g} s apart (mean) if this clock is in {clock.unit.name}, "
        "which is quicker than any log",
        f"Declare a larger unit in dataset.yaml, such as `time: {{column: {clock.column}, unit: "
        f"{_usual_unit(interval, clock.unit.factor)}}}`, or correct the times",
    )


def _usual_unit(interval: float, factor: float) -> str:
    """Unit in which an interval, read by a factor to s that is too small, is a usual one."""
    larger = [(name, 1.0 / size) for name, size in reversed(_LARGER) if factor * size < 1.0]
    usual = (name for name, size in larger if USUAL <= interval / factor * size < SLOW)
    return next(usual, "s")


def _check_span(time: FloatArray, table: Table) -> None:
    if not time[-1] - time[0] <= LONGEST_S:
        raise table.at(TIME, table.rows[-1]).refuse(
            f"the run lasts {time[-1] - time[0]:.4g} s", "Correct the time or its unit"
        )


def check_seconds(dataset: Dataset) -> None:
    """Refuses runs whose times can hardly be in seconds, however they came into memory.

    Raises:
        DatasetError: Names the run, how far its samples are apart and the likely unit.
    """
    for run in dataset.runs:
        interval = float(np.median(np.diff(run.time_s)))
        if interval > SLOWEST:
            raise DatasetError(
                f"{dataset.name}: run {run.id}: the samples are {interval:.4g} s apart (median) "
                f"as if the clock were in {_likely_unit(interval)}, but times are in seconds; "
                "give `time` its unit in dataset.yaml, or correct the times"
            )


def _likely_unit(interval: float) -> str:
    """Unit in which an interval, given as if it were in seconds, is a usual one."""
    return next((name for name, size in _LARGER if interval / size < SLOW), _LARGER[-1][0])


def _beats(commands: FloatArray) -> float:
    """Median commanded frequency of the beating tail, Hz; 0 if it never beats."""
    amplitude, frequency = (
        commands[:, list(COMMANDS).index(name)] for name in ("tail_amplitude", "tail_frequency")
    )
    beating = (amplitude > 0.0) & (frequency > 0.0)
    return float(np.median(frequency[beating])) if beating.any() else 0.0
