"""Reading measured data: a folder with dataset.yaml and its CSV files."""

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fish_env.data.description import FILE_NAME, Description, read_description
from fish_env.data.model_frame import noise_to_model_frame
from fish_env.data.place import closest
from fish_env.data.run_file import read_run
from fish_env.data.schema import Dataset, Run, SteadyDataset, identical_runs
from fish_env.data.steady import read_steady
from fish_env.errors import DatasetError
from fish_env.params import config_root
from fish_env.reading import Unreadable, located


def list_datasets() -> list[str]:
    """Returns the names of the datasets that come with the package, sorted."""
    return sorted(file.parent.name for file in _packaged().glob(f"*/{FILE_NAME}"))


def load_dataset(folder_or_name: str | Path) -> Dataset | SteadyDataset:
    """Reads measured data, into SI units, radians and the model's frame whatever the file uses.

    Args:
        folder_or_name: A folder that holds dataset.yaml, that file itself, or the name of a
            dataset that comes with the package. A folder wins over a name.

    Returns:
        Runs over time, or a table of steady motion if dataset.yaml says `kind: steady`. What was
        left aside or converted is in its notes.

    Raises:
        DatasetError: The data are missing, or not what they are declared to be; names the file,
            the run, the row (line of the file, the header being 1), the column and the remedy.
    """
    description = read_description(find_description(folder_or_name))
    if description.table is not None:
        return read_steady(description, description.table)
    return _read_runs(description)


def dataset_files(folder_or_name: str | Path) -> list[Path]:
    """Returns the files that `load_dataset` reads: dataset.yaml and its tables.

    Raises:
        DatasetError: There is no such dataset, or its description is not as it should be.
    """
    file = find_description(folder_or_name)
    description = read_description(file)
    tables = [entry.file for entry in description.runs]
    return [file, *tables, *([description.table] if description.table is not None else [])]


def find_description(folder_or_name: str | Path) -> Path:
    """Returns the path of a dataset's dataset.yaml.

    Raises:
        DatasetError: There is neither such a folder nor a packaged dataset of that name.
    """
    try:
        path = located(folder_or_name)
    except Unreadable as error:
        raise DatasetError(f"{error}") from None
    log = f"{path}: this is no {FILE_NAME}. If it is a log" if path.is_file() else ""
    if path.is_file() and path.suffix.lower() in ("", ".yaml", ".yml"):
        return path
    if path.is_dir():
        if (path / FILE_NAME).exists() or any(path.glob("*.y*ml")):
            return path / FILE_NAME
        log = f"{path}: this folder holds no {FILE_NAME}. If it holds logs"
    if log:
        raise DatasetError(
            f"{log}, import first: robofish import {shlex.quote(str(path))} --out FOLDER"
        )
    if str(folder_or_name) in list_datasets():
        return _packaged() / str(folder_or_name) / FILE_NAME
    raise DatasetError(
        f"{folder_or_name}: this is neither a folder with {FILE_NAME} nor the name of a dataset "
        f"that comes with the package. {closest(str(folder_or_name), list_datasets())}."
    )


def _packaged() -> Path:
    return config_root() / "datasets"


def _read_runs(description: Description) -> Dataset:
    read = [read_run(description, entry) for entry in description.runs]
    dataset = build_dataset(description, read)
    return replace(dataset, notes=(*_folder_notes(description), *dataset.notes))


def build_dataset(description: Description, read: Sequence[tuple[Run, tuple[str, ...]]]) -> Dataset:
    """Builds a dataset from its runs.

    Args:
        description: What dataset.yaml says.
        read: The runs, each with the notes of its reading.
    """
    runs = tuple(run for run, _ in read)
    run_notes = [note for _, notes in read for note in notes]
    return Dataset(
        name=description.name,
        fish=description.fish,
        runs=runs,
        noise=_model_noise(description),
        about=description.about,
        notes=(*_dataset_notes(description, runs), *run_notes),
        declared={
            name: (description.columns[name].name, unit.name)
            for name, unit in (description.channels | description.commands).items()
        },
        frame=description.frame,
    )


def _model_noise(description: Description) -> dict[str, float]:
    noise = noise_to_model_frame(description.noise, description.columns)
    if "depth" not in noise:
        return noise
    others = {name: sigma for name, sigma in noise.items() if name != "depth"}
    return others | {"z": max(noise["depth"], noise.get("z", 0.0))}


def _dataset_notes(description: Description, runs: tuple[Run, ...]) -> list[str]:
    place, notes = description.place, []
    if description.frame == "enu":
        offset = description.columns.get("tail_offset")
        turned = "no command" if offset is not None and offset.frame == "ned" else "tail_offset"
        notes.append(
            f"{place}: converted from frame enu to ned; of the commands, {turned} changed its sign"
        )
    if "qw" in description.channels:
        notes.append(f"{place}: the quaternion is read as roll, pitch and yaw")
    if "depth" in description.channels:
        notes.append(f"{place}: depth is read as z, which points down")
    for first, second in identical_runs(runs):
        notes.append(f"{place}: runs {first} and {second} hold the same samples")
    return notes


def _folder_notes(description: Description) -> list[str]:
    place = description.place
    listed = {entry.file.resolve() for entry in description.runs}
    return [
        f"{place}: no run names {file.name}, which lies beside it"
        for file in sorted(place.file.parent.glob("*.csv"))
        if file.resolve() not in listed
    ]
