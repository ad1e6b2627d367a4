"""The extended model as a fish: values, effects, posterior covariance and range of validity."""

from __future__ import annotations

from typing import Any

import numpy as np

from fish_env.data.schema import Dataset
from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.series import series_of
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.writing import posterior_of, with_posterior
from fish_env.inference.estimate.fit import Fit
from fish_env.params.schema import FishParams


def extended_fish(fit: Fit, dataset: Dataset) -> FishParams:
    """The fish of a fit, to be saved, simulated, or loaded into the environment.

    Args:
        fit: accepted fit.
        dataset: its runs; they bound the range of validity.
    """
    problem = series_of(fit)
    source = f"fitted to {len(problem.runs)} runs of {dataset.name}"
    return _extended(fit, problem.fish, validity(fit, dataset), source)


def extended_fish_of_table(fit: Fit, problem: TableProblem) -> FishParams:
    """The fish of a fit to a table.

    Args:
        fit: accepted fit.
        problem: its conditions; they bound the range of validity.
    """
    table = problem.table
    source = f"fitted to {len(table.conditions)} conditions of {table.name}"
    return _extended(fit, problem.fish, validity_of_table(problem), source)


def _extended(fit: Fit, fish: FishParams, valid: dict[str, Any], source: str) -> FishParams:
    posterior = posterior_of(fit.names, fit.estimates, fit.covariance, valid)
    return with_posterior(fish, posterior, f"{fish.name}-extended", source)


def validity(fit: Fit, dataset: Dataset) -> dict[str, Any]:
    """Ranges of commands and channels behind the estimates, (low, high)."""
    used = [dataset.run(run.id) for run in series_of(fit).runs]
    commands = np.concatenate([run.commands.values for run in used])
    ranges: dict[str, Any] = {
        name: [float(commands[:, i].min()), float(commands[:, i].max())]
        for i, name in enumerate(COMMANDS)
    }
    for channel in series_of(fit).channels:
        values = np.concatenate([run.channels[channel] for run in used])
        ranges[channel] = [float(np.nanmin(values)), float(np.nanmax(values))]
    return {"dataset": dataset.name, "runs": [run.id for run in used], "ranges": ranges}


def validity_of_table(problem: TableProblem) -> dict[str, Any]:
    """Conditions behind the estimates, and the ranges of their commands and averages."""
    table = problem.table
    ranges: dict[str, Any] = {
        name: [float(column.min()), float(column.max())]
        for name, column in zip(COMMANDS, table.commands.T, strict=True)
    }
    for k, name in enumerate(table.observations):
        seen = table.values[table.present[:, k], k]
        ranges[name] = [float(seen.min()), float(seen.max())]
    return {"dataset": table.name, "conditions": list(table.conditions), "ranges": ranges}
