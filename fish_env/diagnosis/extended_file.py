"""The extended model as a fish: values, effects, posterior covariance and range of validity."""

from __future__ import annotations

from typing import Any

import numpy as np

from fish_env.data.schema import Dataset
from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.extended import PREFIX
from fish_env.identification.estimator import Fit
from fish_env.params.provenance import Posterior
from fish_env.params.schema import FishParams


def extended_fish(fit: Fit, dataset: Dataset) -> FishParams:
    """The fish of a fit, to be saved, simulated, or loaded into the environment.

    Args:
        fit: accepted fit.
        dataset: its runs; they bound the range of validity.
    """
    problem = fit.problem
    count = len(problem.baseline)
    values = dict(zip(fit.names[:count], fit.estimates[:count].tolist(), strict=True))
    source = f"fitted to {len(problem.runs)} runs of {dataset.name}"
    moved = problem.fish.replace(values, "identified", source)
    return _with(moved, _effects(fit), _posterior(fit, dataset))


def _with(
    fish: FishParams, effects: dict[str, dict[str, float]], posterior: Posterior
) -> FishParams:
    from dataclasses import replace

    combined = {**fish.effects, **effects}
    return replace(fish, name=f"{fish.name}-extended", effects=combined, posterior=posterior)


def _effects(fit: Fit) -> dict[str, dict[str, float]]:
    effects: dict[str, dict[str, float]] = {}
    for path, value in fit.point.effects.items():
        name, parameter = path.removeprefix(PREFIX).split(".")
        effects.setdefault(name, {})[parameter] = float(value)
    return effects


def _posterior(fit: Fit, dataset: Dataset) -> Posterior:
    covariance = 0.5 * (fit.covariance + fit.covariance.T)
    rows = tuple(tuple(row) for row in covariance.tolist())
    return Posterior(fit.names, tuple(fit.estimates.tolist()), rows, validity(fit, dataset))


def validity(fit: Fit, dataset: Dataset) -> dict[str, Any]:
    """Ranges of commands and channels behind the estimates, (low, high)."""
    used = [dataset.run(run.id) for run in fit.problem.runs]
    commands = np.concatenate([run.commands.values for run in used])
    ranges: dict[str, Any] = {
        name: [float(commands[:, i].min()), float(commands[:, i].max())]
        for i, name in enumerate(COMMANDS)
    }
    for channel in fit.problem.channels:
        values = np.concatenate([run.channels[channel] for run in used])
        ranges[channel] = [float(np.nanmin(values)), float(np.nanmax(values))]
    return {"dataset": dataset.name, "runs": [run.id for run in used], "ranges": ranges}
