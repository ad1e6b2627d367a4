"""Tables of one kind, such as one topic of every bag: found, named, and their clocks guessed."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.data.importing.bags import RECORDED, STAMP
from fish_env.data.importing.names import TIME_NAMES, take_apart
from fish_env.data.importing.source import Source
from fish_env.data.importing.stamps import TimeColumn, guess_unit
from fish_env.data.units import parse_unit
from fish_env.data.vocabulary import Quantity
from fish_env.errors import DatasetError
from fish_env.reading import short

_WORDS = re.compile(r"[^A-Za-z0-9]+")
SAME_CLOCK = 1.0
"""s. Stamps of messages further than this from their recording are of another clock."""


@dataclass(frozen=True)
class Kind:
    """Tables that one source of a mapping stands for.

    Attributes:
        name: Name of the source.
        files: Pattern of the names of their files.
        part: Pattern of topic, sheet or variable.
        tables: The tables, one a run.
    """

    name: str
    files: str
    part: str
    tables: tuple[Source, ...]

    @property
    def first(self) -> Source:
        """The first table, which stands for all."""
        return self.tables[0]


def find_kinds(sources: Sequence[Source]) -> tuple[Kind, ...]:
    """Puts tables of one kind together: the same topic, or the same columns.

    Args:
        sources: All tables.

    Returns:
        The kinds. Topics of one name are one kind; other tables are if their columns are the same.
    """
    groups: dict[tuple[object, ...], list[Source]] = {}
    for source in sources:
        key = (source.part,) if source.kind else ("", tuple(source.columns))
        groups.setdefault(key, []).append(source)
    kinds, taken = [], set[str]()
    for tables in groups.values():
        name = _name(tables, taken, len(groups) == 1)
        taken.add(name)
        others = [s for s in sources if all(s is not mine for mine in tables)]
        parts = {table.part for table in tables}
        part = next(iter(parts)) if len(parts) == 1 else "*"
        kinds.append(Kind(name, _pattern(tables, others, part), part, tuple(tables)))
    return tuple(kinds)


def _name(tables: Sequence[Source], taken: set[str], alone: bool) -> str:
    part = tables[0].part.split("[")[0].strip("/. ")
    if alone and not part:
        return "log"
    common = set.intersection(*(set(_words(table.file.stem)) for table in tables))
    words = _words(part) or [w for w in _words(tables[0].file.stem) if w in common] or ["log"]
    name = "_".join(words).lower()
    return name if name not in taken else f"{name}_{len(taken) + 1}"


def _words(text: str) -> list[str]:
    return [word for word in _WORDS.split(text) if word]


def _pattern(tables: Sequence[Source], others: Sequence[Source], part: str) -> str:
    """A pattern of file names that fits these tables and no others."""
    names = {table.file.name for table in tables}
    rivals = {o.file.name for o in others if part == "*" or o.part == part}
    if not rivals - names:
        return "*"
    common = set.intersection(*(set(_words(name)) for name in names))
    for word in sorted(common, key=len, reverse=True):
        if not any(word in rival for rival in rivals):
            return f"*{word}*"
    return next(iter(names))


def guess_time(kind: Kind) -> tuple[TimeColumn, str] | None:
    """Guesses the time column of a kind and its unit.

    Args:
        kind: The tables.

    Returns:
        The column, and in words how it was found; None if there is none.
    """
    source = kind.first
    if source.kind:
        return _message_time(source)
    named = [name for name in source.columns if TIME_NAMES.fullmatch(take_apart(name).bare)]
    for column in sorted(named, key=lambda name: _rank(source, name)):
        stated = source.units.get(column) or take_apart(column).unit
        if stated and source.is_numeric(column) and _is_time(stated, source):
            return TimeColumn(column, stated), "as the file says"
        guessed = guess_unit(source, column)
        if guessed is not None:
            return TimeColumn(column, guessed[0]), guessed[1]
    return None


def without_time(kind: Kind) -> DatasetError:
    """The error for tables without a column of times that can be read.

    Args:
        kind: The tables.
    """
    source = kind.first
    for column in source.columns:
        if TIME_NAMES.fullmatch(take_apart(column).bare) and not source.is_numeric(column):
            cell = next((str(cell) for cell in source.columns[column] if str(cell)), "")
            return source.place(column).refuse(
                f"'{short(cell)}' cannot be read as a time",
                "Write times in ISO 8601, such as 2026-05-01T12:00:00.040, or as numbers in any "
                "unit of time",
            )
    return source.place().refuse(
        f"no column is named as a time among {', '.join(source.columns)}",
        "Name it t, time or stamp, with its unit if it is not s: time_ms. Or name it under "
        "`sources` of a mapping, and give --mapping",
    )


def _rank(source: Source, column: str) -> tuple[bool, bool]:
    """Prefers times that differ from row to row, and numbers."""
    values = source.columns[column]
    constant = len(set(values[:50].tolist())) < min(len(values), 50) // 2
    return constant, not source.is_numeric(column)


def _is_time(unit: str, source: Source) -> bool:
    try:
        parse_unit(unit, Quantity("time"), source.place())
    except DatasetError:
        return False
    return True


def _message_time(source: Source) -> tuple[TimeColumn, str]:
    stamps = source.columns.get(STAMP)
    if stamps is None:
        return TimeColumn(RECORDED, "ns"), "when recorded, as its messages have no stamp"
    apart = float(np.median(np.abs(stamps - source.columns[RECORDED]))) / 1e9
    if apart > SAME_CLOCK:
        return TimeColumn(RECORDED, "ns"), (
            f"when recorded, as the stamps are {apart:.3g} s from it, on another clock"
        )
    return TimeColumn(STAMP, "ns"), "stamps of the messages"
