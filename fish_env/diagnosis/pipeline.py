"""``diagnose``: from a folder of measured runs to a verdict with numbers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fish_env.data import Dataset, load_dataset, split_runs
from fish_env.diagnosis.adequacy import Adequacy, adequacy
from fish_env.diagnosis.attribution import Attribution, attribute
from fish_env.diagnosis.causes import causes_of
from fish_env.diagnosis.preconditions import Precondition, preconditions
from fish_env.diagnosis.verdict import Verdict, decide
from fish_env.errors import DatasetError
from fish_env.identification.estimator import Fit, fit
from fish_env.identification.problem import Problem
from fish_env.params.schema import FishParams

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a diagnosis found.

    Attributes:
        dataset: the measured runs.
        final_runs: ids of the runs kept for judging.
        problem: the others.
        attribution: search among causes.
        adequacy: whether the accepted explanation reaches the floor.
        preconditions: what the runs could show.
        verdict: the answer.
        seed: seed of splits and null distributions.
        runtime_s: wall time.
    """

    dataset: Dataset
    final_runs: tuple[str, ...]
    problem: Problem
    attribution: Attribution
    adequacy: Adequacy
    preconditions: tuple[Precondition, ...]
    verdict: Verdict
    seed: int
    runtime_s: float

    @property
    def accepted(self) -> Fit:
        """The accepted fit: extended, or the refitted baseline."""
        return self.attribution.accepted.fit


def diagnose_runs(
    dataset: Dataset,
    fish: FishParams | None = None,
    seed: int = 0,
    quick: bool = False,
    progress: Progress = lambda step: None,
) -> Diagnosis:
    """Diagnose time series.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own.
        seed: of the split and of the null distributions.
        quick: refit fewer causes.
        progress: told the name of each step.
    """
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    fitted, final = _split(dataset, seed)
    progress("refitting the baseline")
    problem = Problem(dataset, fish, fitted)
    baseline = fit(problem, rounds=2)
    causes = causes_of(problem)
    progress("screening causes")
    attribution = attribute(problem, baseline, causes, rng, 3 if quick else 6, progress)
    progress("what the runs could show")
    shown = preconditions(problem, attribution.screens[0], causes)
    progress("testing what is left")
    left = adequacy(attribution.accepted.fit, rng)
    verdict = decide(attribution, left, shown)
    return Diagnosis(
        dataset, final, problem, attribution, left, shown, verdict, seed,
        time.perf_counter() - begin,
    )  # fmt: skip


def _split(dataset: Dataset, seed: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Runs to fit, and a quarter kept for judging where there are at least four."""
    if len(dataset.runs) < 4:
        return dataset.ids, ()
    split = split_runs(dataset, seed, (0.75, 0.0, 0.25))
    return (*split.fit, *split.select), split.final


def load_runs(folder: str | Path) -> Dataset:
    """A dataset of runs.

    Raises:
        DatasetError: refused input, or a table of steady motion.
    """
    dataset = load_dataset(folder)
    if not isinstance(dataset, Dataset):
        raise DatasetError(f"{folder}: a table of steady motion; runs over time are needed here")
    return dataset
