"""Which tables of which files belong to one run."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from fish_env.data.importing.limits import MOST_RUNS
from fish_env.data.importing.plan import Plan, RunSpec, SourceSpec, used_sources
from fish_env.data.importing.source import Source
from fish_env.errors import DatasetError
from fish_env.files import file_name

_WORDS = re.compile(r"[^A-Za-z0-9]+")


@dataclass(frozen=True)
class RunInput:
    """What a run is made of.

    Attributes:
        id: Its name, which can be that of a file.
        sources: The table of each source.
        about: What is told of it: start, tail_phase, condition.
    """

    id: str
    sources: Mapping[str, Source]
    about: Mapping[str, str] = field(default_factory=dict)


def group_runs(plan: Plan, sources: Sequence[Source]) -> tuple[RunInput, ...]:
    """Puts the tables of each run together.

    Args:
        plan: The mapping.
        sources: All tables of the logs.

    Raises:
        DatasetError: A source has no table, or the files do not tell the runs apart.
    """
    tables = {
        name: [source for source in sources if matches(plan.sources[name], source)]
        for name in used_sources(plan)
    }
    for name, found in tables.items():
        if not found:
            spec = plan.sources[name]
            there = ", ".join(dict.fromkeys(source.name for source in sources))
            raise DatasetError(
                f"source {name}: no table matches part '{spec.part}' in files '{spec.files}'. "
                f"There are: {there}."
            )
    runs = (
        [_told(spec, tables) for spec in plan.runs]
        if plan.runs
        else _found(tables, str(plan.content["name"]))
    )
    if plan.run_column is not None:
        runs = [part for run in runs for part in _split(run, plan.run_column, len(runs) > 1)]
    return tuple(runs)


def matches(spec: SourceSpec, source: Source) -> bool:
    """Whether a table belongs to a source."""
    part = source.part == spec.part or fnmatchcase(source.part, spec.part)
    name = source.file.name
    return part and (name == spec.files or fnmatchcase(name, spec.files))


def _told(spec: RunSpec, tables: Mapping[str, list[Source]]) -> RunInput:
    chosen = {}
    for name, found in tables.items():
        mine = [s for s in found if any(fnmatchcase(s.file.name, f) for f in spec.files)]
        if len(mine) != 1:
            raise DatasetError(
                f"run {spec.id}: {len(mine)} tables of source {name} in its files "
                f"({', '.join(spec.files)}). Name files that hold one."
            )
        chosen[name] = mine[0]
    return RunInput(safe_id(spec.id), chosen, spec.about)


def _found(tables: Mapping[str, list[Source]], name: str) -> list[RunInput]:
    if all(len(found) == 1 for found in tables.values()):
        files = {found[0].file for found in tables.values()}
        alone = safe_id(next(iter(files)).stem if len(files) == 1 else name)
        return [RunInput(alone, {source: found[0] for source, found in tables.items()})]
    for keys in _candidates(tables):
        same = len({frozenset(of_source) for of_source in keys.values()}) == 1
        if same and all(len(keys[name]) == len(tables[name]) for name in tables):
            ids = sorted(next(iter(keys.values())), key=_natural)
            return [RunInput(safe_id(id), {n: keys[n][id] for n in tables}) for id in ids]
    counts = ", ".join(f"{len(found)} of {source}" for source, found in tables.items())
    raise DatasetError(
        f"the names of the files do not show which belong to one run ({counts}). Write it "
        "into the mapping: runs: [{id: r1, files: [pose1.csv, servo1.csv]}, ...]."
    )


def _candidates(tables: Mapping[str, list[Source]]) -> list[dict[str, dict[str, Source]]]:
    """Ways to name the run of each table: by file, by folder, by what differs between names."""
    alone = len({source.file for found in tables.values() for source in found}) == 1

    def id(key: str, source: Source, found: list[Source]) -> str:
        file = "" if alone else _key(key, source, found)
        return f"{file} {_part(source, found)}".strip()

    return [
        {name: {id(key, s, found): s for s in found} for name, found in tables.items()}
        for key in ("file", "folder", "words")
    ]


def _key(key: str, source: Source, found: list[Source]) -> str:
    if key == "file":
        return source.file.stem
    if key == "folder":
        return source.file.parent.name
    common = set.intersection(*(set(_words(other.file)) for other in found))
    return "_".join(word for word in _words(source.file) if word not in common) or "run"


def _part(source: Source, found: list[Source]) -> str:
    """Sheet or variable, where a source has several in one file."""
    several = Counter(other.file for other in found)[source.file] > 1
    return source.part.strip("/") if several else ""


def _words(file: Path) -> list[str]:
    return [word for word in _WORDS.split(file.stem) if word]


def _natural(text: str) -> list[tuple[int, int, str]]:
    """Order in which run2 comes before run10."""
    parts = re.split(r"(\d+)", text)
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]


def _split(run: RunInput, column: str, named: bool) -> list[RunInput]:
    """The runs that a column tells apart."""
    ids: dict[str, None] = {}
    labels = {}
    for name, source in run.sources.items():
        cells = source.column(column)
        labels[name] = np.array([_cell_text(cell) for cell in cells], dtype=object)
        ids |= dict.fromkeys(text for text in labels[name].tolist() if text)
        if len(ids) > MOST_RUNS:
            raise source.place(column).refuse(
                f"it separates more than {MOST_RUNS} runs",
                "Name a column that is the same in all rows of a run: --run-column",
            )
    return [
        RunInput(
            safe_id(f"{run.id}-{id}" if named else id),
            {name: source.rows(labels[name] == id) for name, source in run.sources.items()},
            run.about,
        )
        for id in ids
    ]


def _cell_text(cell: object) -> str:
    if isinstance(cell, float | np.floating):
        return "" if np.isnan(cell) else f"{cell:g}"
    return str(cell).strip()


def safe_id(text: str) -> str:
    """The text as a name that a file can have."""
    return file_name(re.sub(r"\s+", "_", text.strip(". ")) or "run")
