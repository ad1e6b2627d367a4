"""Writing measured data in the project's format, so that it reads back equal to the last bit."""

import csv
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fish_env.arrays import FloatArray
from fish_env.data.declared import TIME
from fish_env.data.description import FILE_NAME
from fish_env.data.frames import switch_dataset_frame, switch_steady_frame
from fish_env.data.schema import Dataset, Run, SteadyDataset
from fish_env.data.units import SI_UNIT
from fish_env.data.vocabulary import CHANNELS, COMMANDS, FORMAT, OBSERVATIONS, Quantity
from fish_env.errors import DatasetError
from fish_env.files import FORBIDDEN, file_name, replacing, write_text
from fish_env.params import list_fish
from fish_env.version import stamped

TABLE = "steady.csv"


def write_dataset(dataset: Dataset | SteadyDataset, folder: str | Path, frame: str = "ned") -> Path:
    """Writes a dataset, in SI units: dataset.yaml, and `<run id>.csv` each or steady.csv.

    Written in the model's own frame, it reads back equal. The notes are not written: they tell
    of the files that were read. The path of a fish file is written relative to the folder. A time
    that counts from a date, such as epoch stamps, reads back as counted from the first sample.

    Args:
        dataset: Runs over time, or a table of steady motion.
        folder: Where to write; made if it is not there.
        frame: "ned", or "enu" for tools that want z up; its angles may differ in the last bit.

    Returns:
        The folder.

    Raises:
        DatasetError: The frame is unknown, a run's id cannot be a file name, or the folder
            already holds a dataset or a file of one of the names.
    """
    target = Path(folder)
    if frame not in ("ned", "enu"):
        raise DatasetError(f"frame '{frame}' is not known; use 'ned' or 'enu'.")
    if os.path.lexists(target / FILE_NAME):
        raise DatasetError(f"{target} already holds a dataset; give another folder.")
    if isinstance(dataset, SteadyDataset):
        steady = dataset if frame == "ned" else switch_steady_frame(dataset)
        return _write_steady(steady, target, frame)
    return _write_runs(dataset if frame == "ned" else switch_dataset_frame(dataset), target, frame)


def _write_runs(dataset: Dataset, folder: Path, frame: str) -> Path:
    for run in dataset.runs:
        _check_file_name(run.id)
    check_free(folder, [f"{run.id}.csv" for run in dataset.runs])
    for run in dataset.runs:
        columns = {TIME: run.time_s, **run.channels, **_by_name(run.commands.at(run.time_s))}
        write_table(folder / f"{run.id}.csv", columns)
    _write_description(
        folder,
        dataset,
        frame,
        dataset.runs[0].channels,
        CHANNELS,
        time={"column": TIME, "unit": "s"},
        runs=_run_entries(dataset.runs),
    )
    return folder


def _write_steady(dataset: SteadyDataset, folder: Path, frame: str) -> Path:
    check_free(folder, [TABLE])
    names = {"id": dataset.ids, "condition": [c or "" for c in dataset.conditions]}
    columns = {**names, **_by_name(dataset.commands), **dataset.observations}
    write_table(folder / TABLE, columns)
    _write_description(
        folder, dataset, frame, dataset.observations, OBSERVATIONS, kind="steady", file=TABLE
    )
    return folder


def check_free(folder: Path, names: Iterable[str]) -> None:
    """Refuses to write over files in a folder.

    Args:
        folder: The folder.
        names: Names of the files that will be written.

    Raises:
        DatasetError: One of them is there already.
    """
    for name in names:
        if os.path.lexists(folder / name):  # a link, too, whatever it points to
            raise DatasetError(
                f"{folder / name} already exists and would be overwritten; give another folder."
            )


def _check_file_name(id: str) -> None:
    if id != file_name(id):
        raise DatasetError(
            f"run '{id}': the id cannot be a file name; rename the run without {FORBIDDEN}"
        )


def _by_name(commands: FloatArray) -> dict[str, FloatArray]:
    return dict(zip(COMMANDS, commands.T, strict=True))


def write_table(file: Path, columns: Mapping[str, Iterable[Any]]) -> None:
    """Writes columns of numbers or text as a CSV file; a missing number is an empty cell."""
    with replacing(file) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*map(_cells, columns.values()), strict=True))


def _cells(values: Iterable[Any]) -> list[str]:
    if not isinstance(values, np.ndarray):
        return list(values)
    # repr gives the shortest text that reads back as the same number.
    return ["" if value != value else repr(value) for value in values.tolist()]


def _write_description(
    folder: Path,
    dataset: Dataset | SteadyDataset,
    frame: str,
    channels: Iterable[str],
    known: Mapping[str, Quantity],
    **form: Any,
) -> None:
    content = {
        "format": FORMAT,
        "name": dataset.name,
        "fish": fish_reference(dataset.fish, folder),
        "frame": frame,
        **dataset.about,
        "channels": {name: SI_UNIT[known[name].dimension] for name in channels},
        "commands": {name: SI_UNIT[quantity.dimension] for name, quantity in COMMANDS.items()},
        "noise": {name: float(sigma) for name, sigma in dataset.noise.items()},
        **form,
    }
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)
    write_text(folder / FILE_NAME, stamped(text))


def fish_reference(fish: str, folder: Path) -> str:
    """Names a fish as dataset.yaml in a folder does: by its preset, or by a path from there."""
    return fish if fish in list_fish() else os.path.relpath(fish, folder.resolve())


def _run_entries(runs: Iterable[Run]) -> list[dict[str, Any]]:
    return [_run_entry(run) for run in runs]


def _run_entry(run: Run) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "id": run.id,
        "file": f"{run.id}.csv",
        "start": run.start,
        "tail_phase": "unknown" if run.tail_phase is None else float(run.tail_phase),
    }
    return entry if run.condition is None else entry | {"condition": run.condition}
