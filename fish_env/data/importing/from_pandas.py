"""Pandas frames made into a dataset."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fish_env.data.importing.assemble import assemble_runs
from fish_env.data.importing.grouping import RunInput, safe_id
from fish_env.data.importing.guess import UNKNOWN_START, guess_mapping
from fish_env.data.importing.plan import FORMAT, Content, fish_path, parse_plan
from fish_env.data.importing.source import Source, Values
from fish_env.data.importing.stamps import guess_unit
from fish_env.data.place import Place
from fish_env.data.schema import Dataset
from fish_env.errors import DatasetError
from fish_env.reading import printable, shown

if TYPE_CHECKING:
    import pandas as pd

    Frames = pd.DataFrame | Mapping[str, pd.DataFrame | Mapping[str, pd.DataFrame]]

_MISSING = ("<NA>", "NaT")
SINGLE = "frame"
"""Name of the source where a run has one frame."""


def from_frames(
    frames: Frames,
    *,
    fish: str | Path,
    frame: str,
    channels: Mapping[str, str | Mapping[str, Any]] | None = None,
    commands: Mapping[str, str | Mapping[str, Any]] | None = None,
    constant_commands: Mapping[str, float] | None = None,
    time: str | Mapping[str, Any] | None = None,
    name: str = "frames",
    start: str = "unknown",
    tail_phase: float | str = "unknown",
    conditions: Mapping[str, str] | None = None,
    noise: Mapping[str, float] | None = None,
) -> Dataset:
    """Makes a dataset of pandas frames.

    Args:
        frames: One frame, or one for each run by its name. Where a run has several, each on a
            clock of its own, they are a mapping by name: `{"run1": {"pose": ..., "servo": ...}}`.
        fish: A fish that comes with the package, or the path of a parameter file.
        frame: Frame of the channels, "ned" or "enu".
        channels: For each channel its unit, if its column has the channel's name, or a mapping
            with `unit` and, where needed, `column`, `sign`, `scale`, `frame` and, with several
            frames in a run, `source`. Left out, channels, commands and time are guessed from the
            names of the columns, and a warning says how.
        commands: The same for commands. `between` may say "hold" (a value holds until the next,
            as if not said) or "linear".
        constant_commands: Value of each command without a column, SI.
        time: Name of the time column, in seconds unless it holds dates, or a mapping with `column`
            and `unit`, or such a mapping for each of a run's frames. "t" if left out.
        name: Name of the dataset.
        start: "rest" or "unknown", for all runs.
        tail_phase: Tail phase at the first sample, rad, or "unknown", for all runs.
        conditions: Name that repeats share, by run.
        noise: One-sigma noise by channel, in the channel's unit.

    Returns:
        The dataset, in SI units and the model's frame. What was assumed, filled or left out is in
        its notes.

    Raises:
        DatasetError: A column is missing, or the values cannot be what is said of them.
    """
    name = str(_plain(name, "name"))
    tables = _tables(frames, name)
    told = {"fish": _fish(fish), "frame": frame, "start": start, "tail_phase": tail_phase}
    told = {key: _plain(value, key) for key, value in told.items()}
    assumptions: tuple[str, ...] = ()
    if channels is None:
        content, assumptions = _guessed(tables, name, told)
    else:
        content = {"format": FORMAT, "name": name, **told}
        content["sources"] = {
            part: {"part": part, "time": _time(time, part, source)}
            for part, source in next(iter(tables.values())).items()
        }
        content["channels"] = _entries(channels, "channels")
        content["commands"] = _entries(commands or {}, "commands")
        content["constant_commands"] = _mapping(constant_commands or {}, "constant_commands")
    if noise is not None:
        content["noise"] = _mapping(noise, "noise")
    told_of = _mapping(conditions or {}, "conditions")
    about = {run: {"condition": str(word)} for run, word in told_of.items()}
    runs = [RunInput(safe_id(run), own, about.get(run, {})) for run, own in tables.items()]
    imported = assemble_runs(parse_plan(content, Path("from_frames")), runs, Path(name))
    about_source = {key: text for key, text in imported.dataset.about.items() if key != "comment"}
    return replace(
        imported.dataset,
        about={**about_source, "source": "pandas"},
        notes=(*assumptions, *imported.notes, *imported.dataset.notes),
    )


def _guessed(
    tables: Mapping[str, Mapping[str, Source]], name: str, told: Content
) -> tuple[Content, tuple[str, ...]]:
    sources = [source for own in tables.values() for source in own.values()]
    guess = guess_mapping(sources, name, told["fish"], told["frame"])
    parts = {source.part for source in sources}
    content = {**guess.content, **told}
    names = {n: spec.get("part", "") for n, spec in content["sources"].items()}
    # Sources are known by the names of the frames.
    content["sources"] = {
        names[n]: spec for n, spec in content["sources"].items() if names[n] in parts
    }
    for key in ("channels", "commands"):
        content[key] = {
            n: {**entry, "source": names[entry["source"]]} for n, entry in content[key].items()
        }
    assumed = [words for words in guess.assumptions if words != UNKNOWN_START]
    if told["start"] == "unknown":
        assumed.append(
            "start and tail_phase: estimated from each run, unless start='rest' is given"
        )
    warnings.warn(
        "from_frames guesses the meaning of columns; give `channels` to declare it. Assumed: "
        f"{'; '.join(assumed)}",
        stacklevel=3,
    )
    return content, tuple(f"assumed: {words}" for words in assumed)


def _tables(frames: Frames, name: str) -> dict[str, dict[str, Source]]:
    """A source for each frame, by run and by name of the frame."""
    by_run = frames if isinstance(frames, Mapping) else {name: frames}
    if not by_run:
        raise DatasetError("from_frames: there is no frame; give at least one run")
    tables = {}
    for run, own in by_run.items():
        several = own if isinstance(own, Mapping) else {SINGLE: own}
        tables[str(run)] = {
            str(part): frame_source(frame, str(run), str(part)) for part, frame in several.items()
        }
    first = next(iter(tables.values())).keys()
    other = next((run for run, own in tables.items() if own.keys() != first), None)
    if other is not None:
        raise DatasetError(
            f"from_frames: run {other} has the frames {', '.join(tables[other])}, and other runs "
            f"{', '.join(first)}; give all runs the same"
        )
    return tables


def frame_source(frame: pd.DataFrame, run: str, part: str) -> Source:
    """A frame as a table of a log; an index with a name, or of dates, is a column too.

    Args:
        frame: The frame.
        run: Name of its run.
        part: Its name in the run.

    Raises:
        DatasetError: It is no frame, has no rows, or two columns of one name.
    """
    if not (hasattr(frame, "columns") and hasattr(frame, "index")):
        raise DatasetError(
            f"from_frames: {run}: of type {type(frame).__name__}, which is not a pandas frame. "
            "Give a frame, or frames by run: {'run1': frame}."
        )
    dated = frame.index.dtype.kind in "mM"
    index = str(frame.index.name or "time")
    if (frame.index.name is not None or dated) and index not in frame.columns:
        frame = frame.reset_index(names=index)
    columns, units = dict[str, Values](), dict[str, str]()
    source = Source(Path(run), part, {})
    for position, label in enumerate(frame.columns):
        name = str(label)
        if name in columns:
            raise source.place(name).refuse("two columns have this name", "Rename one of them")
        columns[name], unit = _values(frame.iloc[:, position])
        units |= {name: unit} if unit else {}
    if len(frame) < 2:
        raise source.place().refuse(f"{len(frame)} rows", "Give at least two")
    return Source(Path(run), part, columns, units)


def _values(column: Any) -> tuple[Values, str]:
    """A column as an array, and its unit where its type has one."""
    kind = column.dtype.kind
    if kind in "mM":
        naive = column.dt.tz_convert("UTC").dt.tz_localize(None) if _has_zone(column) else column
        missing = naive.isna()
        if missing.any():
            raise DatasetError(
                f"from_frames: column {column.name}: row {missing.argmax()} has no time"
            )
        return naive.to_numpy().astype(f"{kind}8[ns]").astype(np.int64), "ns"
    if kind in "iu" and not column.isna().any():
        return column.to_numpy(dtype=np.int64), ""
    if kind in "iufb":
        return column.to_numpy(dtype=np.float64, na_value=np.nan), ""
    return np.array(["" if _is_missing(cell) else str(cell) for cell in column], dtype=object), ""


def _is_missing(cell: object) -> bool:
    """Whether a cell of any kind is empty, NaN or what pandas writes for it."""
    return cell is None or (isinstance(cell, float) and cell != cell) or str(cell) in _MISSING


def _has_zone(column: Any) -> bool:
    return getattr(column.dtype, "tz", None) is not None


def _fish(fish: str | Path) -> str:
    return fish_path(str(fish), Place(Path("from_frames")))


def _plain(value: Any, name: str) -> Any:
    """A value as YAML holds it.

    Raises:
        DatasetError: It is no text, number or mapping of these.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{name}: {key}") for key, item in value.items()}
    raise DatasetError(
        printable(f"from_frames: {name}: {shown(value)} is no text, number or mapping; give one")
    )


def _mapping(value: Any, name: str) -> Content:
    if not isinstance(value, Mapping):
        raise DatasetError(
            f"from_frames: {name}: {shown(value)}; give a mapping by name, such as {{'x': ...}}"
        )
    return dict(_plain(value, name))


def _entries(declared: Any, name: str) -> Content:
    """Entries of a mapping; a unit alone means the column of the channel's name."""
    entries = _mapping(declared, name)
    return {
        key: {"column": key, **({"unit": str(entry)} if not isinstance(entry, dict) else entry)}
        for key, entry in entries.items()
    }


def _time(time: str | Mapping[str, Any] | None, part: str, source: Source) -> Content:
    """Time column and unit of one of a run's frames."""
    if isinstance(time, Mapping) and "column" not in time:
        time = time.get(part)
    if time is None or isinstance(time, str):
        given = {"column": time or "t"}
    else:
        given = _mapping(time, "time")
    column = str(given.get("column", "t"))
    if column not in source.columns:
        raise source.place().refuse(
            f"no column '{column}' holds the times",
            "Give time={'column': NAME, 'unit': 's'} with one of: " + ", ".join(source.columns),
        )
    if "unit" in given:
        return given
    stated = source.units.get(column)
    guessed = stated or (guess_unit(source, column) or ("s",))[0]
    if guessed not in ("s", stated):
        raise source.place(column).refuse(
            f"this looks like a time in {guessed}, and no unit is given",
            f"Give time={{'column': '{column}', 'unit': '{guessed}'}}, or 's' if it is in seconds",
        )
    return {**given, "unit": guessed}
