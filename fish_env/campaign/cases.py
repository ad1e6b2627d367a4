"""Which data sets a campaign diagnoses, and the diagnosis of one as a task that can travel."""

from __future__ import annotations

import dataclasses
import glob
import hashlib
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fish_env.data import Dataset, SteadyDataset, dataset_files, list_datasets, load_dataset
from fish_env.diagnosis.pipeline import diagnose
from fish_env.diagnosis.writing import outputs
from fish_env.effects import catalogue
from fish_env.errors import DatasetError
from fish_env.files import check_outputs, file_name
from fish_env.params.io import as_fish, fish_files
from fish_env.params.schema import FishParams

DESCRIPTION = "dataset.yaml"


@dataclasses.dataclass(frozen=True)
class Options:
    """How every data set is diagnosed, as for ``robofish diagnose``.

    Attributes:
        fish: another fish than the data sets name: preset or file.
        seed: of all that is random.
        quick: a first look only.
        measured_beats: tail frequencies from the hull's swaying.
        trust_effects: run the effect files that the fish's file names.
        patient: search without a limit.
    """

    fish: str | None = None
    seed: int = 0
    quick: bool = False
    measured_beats: bool = False
    trust_effects: bool = False
    patient: bool = False


@dataclasses.dataclass(frozen=True)
class Case:
    """One data set of a campaign.

    Attributes:
        name: of its folder among the results.
        source: folder of the data set, or name of a shipped one.
    """

    name: str
    source: str


@dataclasses.dataclass(frozen=True)
class Payload:
    """What travels to the machine that diagnoses: the data themselves, no paths.

    Attributes:
        dataset: in memory.
        fish: its parameters.
        options: how it is diagnosed.
        digest: tells data, fish and options from others: a hash of the files and of what was asked.
    """

    dataset: Dataset | SteadyDataset
    fish: FishParams
    options: Options
    digest: str


@dataclasses.dataclass(frozen=True)
class Diagnosed:
    """What comes back.

    Attributes:
        answer: content of ``diagnosis.json``.
        files: content of each file, by its path below the folder of the diagnosis.
    """

    answer: dict[str, Any]
    files: dict[str, bytes]


def find_cases(patterns: Sequence[str]) -> list[Case]:
    """The data sets that the words of a command mean, each once, sorted by name.

    Args:
        patterns: folders with a dataset.yaml, folders of such folders, patterns with ``*`` or
            ``**`` for either, and names of shipped data sets.

    Raises:
        DatasetError: a word means no data set.
    """
    sources: dict[Path, str] = {}
    shipped = list_datasets()
    for pattern in patterns:
        found = _folders(pattern)
        for folder in found:
            sources.setdefault(folder.resolve(), str(folder))
        if not found and pattern in shipped:
            sources.setdefault(Path(pattern), pattern)
        elif not found:
            raise DatasetError(
                f"{pattern}: no folder with {DESCRIPTION} there or one level below; correct the "
                f"path or pattern, or name a shipped data set ({', '.join(shipped)})"
            )
    return sorted(_named(sources), key=lambda case: case.name)


def _folders(pattern: str) -> list[Path]:
    path = Path(pattern).expanduser()
    places = [path] if path.exists() else map(Path, glob.glob(str(path), recursive=True))
    found = []
    for place in sorted(places):
        if place.name == DESCRIPTION:
            found.append(place.parent)
        elif (place / DESCRIPTION).is_file():
            found.append(place)
        else:
            found += [file.parent for file in sorted(place.glob(f"*/{DESCRIPTION}"))]
    return found


def _named(sources: dict[Path, str]) -> Iterable[Case]:
    """Names by the folders; where two have the same, with as many folders above as it takes."""
    paths = list(sources)
    for path in paths:
        for depth in range(1, len(path.parts) + 1):
            tail = path.parts[-depth:]
            if sum(other.parts[-depth:] == tail for other in paths) == 1:
                break
        yield Case(file_name("-".join(tail).replace("/", "")), sources[path])


def prepare(case: Case, options: Options, folder: Path, *others: Path) -> Payload:
    """Reads a data set and its fish.

    Args:
        case: which.
        options: how it is diagnosed.
        folder: where the diagnosis will be written.
        others: other files that will be written.

    Raises:
        DatasetError, ParameterError: the data or the fish cannot be used.
        OutputError: an output would replace a file that is read.
    """
    dataset = load_dataset(case.source)
    fish = as_fish(options.fish or dataset.fish, options.trust_effects)
    read = [*dataset_files(case.source), *fish_files(fish)]
    check_outputs([*outputs(fish, folder), *others], read)
    if not set(fish.effects) - set(catalogue()):
        # Without a file of its own the fish is whole, and another machine need not have the file.
        fish = dataclasses.replace(fish, source_file=None)
    return Payload(dataset, fish, options, _digest(read, options))


def _digest(files: Iterable[Path], options: Options) -> str:
    asked: tuple[object, ...] = (options.seed, options.quick, options.measured_beats)
    if options.patient:  # else as before, so that campaigns of earlier versions go on
        asked = (*asked, "patient")
    total = hashlib.sha256(repr(asked).encode())
    for file in files:
        content = file.read_bytes() if file.is_file() else b""
        total.update(hashlib.sha256(content).digest())
    return total.hexdigest()


def diagnosed(payload: Payload) -> Diagnosed:
    """Diagnoses one data set; the same payload gives the same result on any machine.

    Args:
        payload: from :func:`prepare`.
    """
    options = payload.options
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "out"
        answer = diagnose(
            payload.dataset, folder, options.seed, options.quick, payload.fish,
            measured_beats=options.measured_beats, trust_effects=options.trust_effects,
            patient=options.patient,
        )  # fmt: skip
        written = sorted(file for file in folder.rglob("*") if file.is_file())
        files = {file.relative_to(folder).as_posix(): file.read_bytes() for file in written}
    return Diagnosed(answer, files)
