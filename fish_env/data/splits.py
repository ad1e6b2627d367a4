"""Division of a dataset into parts for fitting, selecting and the final check, by whole runs."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.errors import DatasetError


@dataclass(frozen=True)
class Split:
    """Ids of the runs in each part, in the dataset's order.

    Attributes:
        fit: Runs to estimate on.
        select: Runs to choose between models on.
        final: Runs to be opened once, for the result that is reported.
    """

    fit: tuple[str, ...]
    select: tuple[str, ...]
    final: tuple[str, ...]


def split_runs(
    dataset: Dataset | SteadyDataset,
    seed: int,
    fractions: tuple[float, float, float] = (0.5, 0.25, 0.25),
    by: Literal["run", "condition"] = "run",
) -> Split:
    """Divides the runs of a dataset at random, never the samples of a run.

    Every part with a positive fraction gets at least one run (or condition); the others are
    shared out as near to the fractions as whole ones go.

    Args:
        dataset: Runs, or the rows of a steady table.
        seed: The same seed and the same ids give the same split, in whatever order they stand.
        fractions: Shares of fit, select and final; they must sum to one.
        by: "run", or "condition" to keep repeats of one condition in the same part; a run
            without a condition is one of its own.

    Raises:
        DatasetError: The fractions or `by` are not possible, or there are too few runs.
    """
    shares = _check_fractions(fractions)
    groups = _groups(dataset, by)
    counts = _counts(len(groups), shares, f"{dataset.name}: {len(groups)} {by}(s)")
    names = sorted(groups)
    order = np.random.default_rng(seed).permutation(len(names))
    bounds = np.cumsum(counts)[:-1]
    parts = [{id for i in part for id in groups[names[i]]} for part in np.split(order, bounds)]
    return Split(*(tuple(id for id in dataset.ids if id in part) for part in parts))


def _check_fractions(fractions: tuple[float, float, float]) -> FloatArray:
    shares = np.asarray(fractions, dtype=np.float64)
    possible = shares.shape == (3,) and bool((shares >= 0.0).all())
    if not possible or not np.isclose(shares.sum(), 1.0):
        raise DatasetError(
            f"fractions {fractions} are not shares of fit, select and final; "
            "give three numbers of at least 0 that sum to 1."
        )
    return shares


def _groups(dataset: Dataset | SteadyDataset, by: str) -> dict[tuple[str, str], list[str]]:
    if by not in ("run", "condition"):
        raise DatasetError(f"runs can be split by 'run' or 'condition', not by '{by}'.")
    groups: dict[tuple[str, str], list[str]] = {}
    for id, condition in zip(dataset.ids, dataset.conditions, strict=True):
        together = by == "condition" and condition is not None
        # A run may have the name of a condition it does not belong to.
        key = ("condition", str(condition)) if together else ("run", id)
        groups.setdefault(key, []).append(id)
    return groups


def _counts(total: int, shares: FloatArray, owner: str) -> IntArray:
    needed = (shares > 0.0).astype(int)
    if total < needed.sum():
        raise DatasetError(
            f"{owner} cannot fill {needed.sum()} parts; measure more of them, split by 'run', "
            "or set the fraction of a part to 0."
        )
    wanted = shares * total
    counts: IntArray = np.maximum(np.floor(wanted).astype(int), needed)
    while counts.sum() != total:
        # One at a time to or from the part furthest from its share, none emptied.
        step = 1 if counts.sum() < total else -1
        movable = (shares > 0.0) if step > 0 else (counts > needed)
        gap = np.where(movable, step * (wanted - counts), -np.inf)
        counts[int(np.argmax(gap))] += step
    return counts
