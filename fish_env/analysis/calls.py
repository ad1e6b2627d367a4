"""The three calls, each a thin wrapper of what the command of its name does."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from fish_env import comparison, diagnosis
from fish_env.analysis.results import CompareResult, DiagnoseResult, FitResult
from fish_env.data import Dataset, SteadyDataset, from_frames, load_dataset
from fish_env.diagnosis.input_checks import check_runs
from fish_env.diagnosis.inputs.check import refuse_wrong_inputs
from fish_env.errors import DatasetError
from fish_env.identification.dataset_fit import fit_dataset
from fish_env.params import FishParams, as_fish

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    Frames = pd.DataFrame | Mapping[str, pd.DataFrame | Mapping[str, pd.DataFrame]]
    Data = str | Path | Dataset | SteadyDataset | Frames

Described = Mapping[str, Any] | None


def compare(
    data: Data,
    fish: FishParams | str | Path | None = None,
    *,
    dt: float = 0.01,
    described: Described = None,
    trust_effects: bool = False,
    progress: bool = True,
) -> CompareResult:
    """Compare measured motion with its simulation: how wrong it is, and where.

    Args:
        data: Folder with a dataset.yaml, name of a shipped dataset, a dataset, or pandas frames.
        fish: Another fish than the data name; frames name none, so they need it.
        dt: Longest physics step, s.
        described: What :func:`fish_env.data.from_frames` is told of frames, such as
            `{"frame": "ned", "channels": {"x": "m"}}`.
        trust_effects: Run the effect files that the fish's file names, see `load_fish`.
        progress: Show a progress bar, if tqdm is installed.

    Raises:
        RoboticFishError: The data or the fish cannot be used.
    """
    dataset = as_dataset(data, fish, described)
    total = len(dataset.runs) if isinstance(dataset, Dataset) else None
    with progress_bar(progress, "simulating", total) as tell:
        found = comparison.compare(dataset, fish, dt, trust_effects, tell)
    return CompareResult(found)


def fit(
    data: Data,
    fish: FishParams | str | Path | None = None,
    *,
    described: Described = None,
    trust_effects: bool = False,
    progress: bool = True,
    **options: Any,
) -> FitResult:
    """Fit a fish's coefficients to measured data.

    Args:
        data: As for :func:`compare`.
        fish: As for :func:`compare`.
        described: As for :func:`compare`.
        trust_effects: As for :func:`compare`.
        progress: As for :func:`compare`.
        **options: Of :func:`fish_env.identification.dataset_fit.fit_dataset`, such as `effects`,
            `objective` and `leave_out`.

    Raises:
        RoboticFishError: The data, the fish or an option cannot be used.
    """
    dataset = as_dataset(data, fish, described)
    chosen = as_fish(fish or dataset.fish, trust_effects)
    if isinstance(dataset, Dataset):
        check_runs(dataset)
        refuse_wrong_inputs(dataset, chosen)
    with progress_bar(progress, "fitting") as tell:
        return FitResult(fit_dataset(dataset, chosen, report=tell, **options))


def diagnose(
    data: Data,
    fish: FishParams | str | Path | None = None,
    *,
    out: str | Path | None = None,
    quick: bool = False,
    rng: int | np.random.Generator = 0,
    measured_beats: bool = False,
    described: Described = None,
    trust_effects: bool = False,
    progress: bool = True,
) -> DiagnoseResult:
    """Find what the simulation gets wrong: a cause with numbers, or none that is known.

    Args:
        data: As for :func:`compare`.
        fish: As for :func:`compare`.
        out: Folder for the report and the extended fish; without it they are kept as long as the
            result, and `save` writes them.
        quick: Fit the first 20 s of two runs and skip the comparison of rival causes.
        rng: Seed of the split into runs and of the null distributions, or a generator that one is
            drawn from. The seed stands in the answer.
        measured_beats: Take the tail's frequencies from the hull's swaying, not as commanded.
        described: As for :func:`compare`.
        trust_effects: As for :func:`compare`.
        progress: As for :func:`compare`.

    Raises:
        RoboticFishError: The data or the fish cannot be used.
    """
    source = data if isinstance(data, str | Path) else as_dataset(data, fish, described)
    kept = TemporaryDirectory(prefix="robofish-") if out is None else None
    folder = Path(out) if kept is None else Path(kept.name)  # type: ignore[arg-type]
    seed = rng if isinstance(rng, int) else int(rng.integers(2**31))
    with progress_bar(progress, "diagnosing") as tell:
        answer = diagnosis.diagnose(
            source, folder, seed, quick, fish, tell, measured_beats, trust_effects
        )
    return DiagnoseResult(answer, folder, kept)


def as_dataset(
    data: Data, fish: FishParams | str | Path | None, described: Described
) -> Dataset | SteadyDataset:
    """Returns the dataset that an argument means.

    Args:
        data: As for :func:`compare`.
        fish: As for :func:`compare`.
        described: As for :func:`compare`.

    Raises:
        DatasetError: The data cannot be read, or frames come without a fish or a description.
    """
    if isinstance(data, str | Path):
        return load_dataset(data)
    if isinstance(data, Dataset | SteadyDataset):
        return data
    if not (isinstance(data, Mapping) or hasattr(data, "columns")):
        raise DatasetError(
            f"data of type {type(data).__name__}: give a folder with dataset.yaml, the name of a "
            "shipped dataset, a dataset, a pandas frame, or frames by run: {'run1': frame}"
        )
    if fish is None:
        raise DatasetError("frames name no fish: give one, such as fish='zheng-2021-a'")
    if not described or "frame" not in described:
        raise DatasetError("frames need described={'frame': 'ned' or 'enu', ...}, see from_frames")
    named = fish.source_file if isinstance(fish, FishParams) else fish
    if named is None:
        raise DatasetError(f"{fish}: save this fish with save_fish, and give its file with frames")
    return from_frames(data, fish=named, **described)


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this."""
    shell = sys.modules.get("IPython")
    return shell is not None and hasattr(shell.get_ipython(), "kernel")


@contextmanager
def progress_bar(
    wanted: bool, title: str, total: int | None = None
) -> Iterator[Callable[[str], None]]:
    """A progress bar for a terminal or a notebook, if tqdm is installed; it goes when done.

    Args:
        wanted: Show it.
        title: What is done.
        total: Steps; None if not known.

    Yields:
        To be called with the name of each step.
    """
    if not wanted:
        yield lambda step: None
        return
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # without ipywidgets the bar is of text
            from tqdm.auto import tqdm
    except ImportError:
        yield lambda step: None
        return
    # disable=None shows none where the error stream is no terminal, as that of a notebook.
    disable = False if _in_notebook() else None
    with tqdm(total=total, desc=title, leave=False, disable=disable) as bar:

        def tell(step: str) -> None:
            bar.set_postfix_str(step, refresh=False)
            bar.update()

        yield tell
