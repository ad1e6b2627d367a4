"""Groups of runs that are left out together, and errors of fits that never saw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.data.vocabulary import COMMANDS
from fish_env.errors import DatasetError
from fish_env.identification.objectives import Errors, Objective, refit
from fish_env.identification.tables.problem import TableProblem
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.problem import Problem
from fish_env.inference.progress import Report, silent

COLUMNS = ("condition", "run", *COMMANDS)


@dataclass(frozen=True)
class RunErrors:
    """Errors of the prediction of one run.

    Attributes:
        run: its id; of a table, the condition's name.
        group: what was left out of the fit together with it; None where nothing was.
        errors: quantity -> mean absolute error, SI.
    """

    run: str
    group: str | None
    errors: Errors


def groups_of(
    dataset: Dataset | SteadyDataset, problem: Problem, column: str
) -> dict[str, list[int]]:
    """Label -> numbers of the problem's runs that have it.

    Args:
        dataset: the data.
        problem: made of all of it.
        column: ``condition``, ``run``, or a command, whose values are left out one by one.

    Raises:
        DatasetError: there is no such column, or it has one value only.
    """
    if column not in COLUMNS:
        raise DatasetError(f"--leave-out {column}: choose one of {', '.join(COLUMNS)}")
    labels = _labels(dataset, problem, column)
    groups: dict[str, list[int]] = {}
    for i, label in enumerate(labels):
        groups.setdefault(label, []).append(i)
    if len(groups) < 2:
        raise DatasetError(
            f"{dataset.name}: all runs have one {column}, {next(iter(groups))}; to leave some out, "
            "give --leave-out run or another column"
        )
    return groups


def _labels(dataset: Dataset | SteadyDataset, problem: Problem, column: str) -> list[str]:
    if column == "run" or (column == "condition" and isinstance(problem, TableProblem)):
        return list(problem.run_ids)
    if column == "condition" and isinstance(dataset, Dataset):
        known = {run.id: run.condition for run in dataset.runs}
        return [known[i] or i for i in problem.run_ids]
    at = list(COMMANDS).index(column)
    if isinstance(problem, TableProblem):
        return [f"{value:.6g}" for value in problem.table.commands[:, at]]
    assert isinstance(dataset, Dataset)
    labels = []
    for name in problem.run_ids:
        values = np.unique(dataset.run(name).commands.values[:, at])
        if len(values) > 1:
            raise DatasetError(
                f"{dataset.name}: {column} changes within run {name}; give --leave-out condition "
                "or run"
            )
        labels.append(f"{values[0]:.6g}")
    return labels


def left_out_errors(
    objective: Objective,
    whole: Fit,
    groups: dict[str, list[int]],
    report: Report = silent,
) -> tuple[RunErrors, ...]:
    """Errors of every run by a fit to the runs of all other groups.

    Args:
        objective: how runs are fitted and judged.
        whole: fit to all runs, whose estimates the others begin from.
        groups: label -> numbers of runs.
        report: told what is being done.
    """
    problem, found = whole.problem, {}
    for number, (label, out) in enumerate(groups.items(), start=1):
        report(f"leaving out {label} ({number} of {len(groups)})")
        kept = [i for i in range(problem.run_count) if i not in out]
        part = refit(objective, whole, problem.some(kept))
        held = problem.some(out)
        for i, errors in zip(out, objective.errors(held, part), strict=True):
            found[i] = RunErrors(problem.run_ids[i], label, errors)
    return tuple(found[i] for i in sorted(found))


def mean_errors(runs: Sequence[RunErrors]) -> Errors:
    """Quantity -> mean over runs of their mean absolute errors, SI."""
    names = dict.fromkeys(name for run in runs for name in run.errors)
    return {n: float(np.mean([r.errors[n] for r in runs if n in r.errors])) for n in names}
