"""A fit as a fish: values, where they come from, and how surely they are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.whole_runs.problem import WholeRunProblem
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import Coefficient, ParameterId
from fish_env.params.provenance import Posterior
from fish_env.params.schema import FishParams


def identified_fish(fit: Fit, name: str | None = None) -> FishParams:
    """The fish of a fit, with status ``identified``, its posterior and what its data covered.

    It loads wherever a fish does; its posterior can drive the environment's randomisation.

    Args:
        fit: result of an identification from runs one sample ahead, whole runs, or a table.
        name: name of the new fish; default: that of the old one and ``-extended``.
    """
    problem = fit.problem
    assert isinstance(problem, SeriesProblem | WholeRunProblem | TableProblem)
    valid = validity_of(problem)
    kind = "conditions" if isinstance(problem, TableProblem) else "runs"
    whole = " over their whole length" if isinstance(problem, WholeRunProblem) else ""
    source = f"identified from {problem.run_count} {kind} of {valid['dataset']}{whole}"
    symmetric = 0.5 * (fit.covariance + fit.covariance.T)
    rows = tuple(tuple(row) for row in symmetric.tolist())
    names = tuple(map(str, fit.ids))
    posterior = Posterior(names, tuple(fit.estimates.tolist()), rows, valid)
    moved = _moved(problem.fish, dict(zip(fit.ids, posterior.mean, strict=True)), source)
    name = name or f"{problem.fish.name}-extended"
    return replace(moved, name=name, posterior=posterior, source_file=None)


def _moved(fish: FishParams, values: Mapping[ParameterId, float], source: str) -> FishParams:
    """The fish with other values, with status ``identified``."""
    coefficients = {id.path: v for id, v in values.items() if isinstance(id, Coefficient)}
    moved = fish.replace(coefficients, "identified", source)
    effects = {effect: dict(known) for effect, known in moved.effects.items()}
    for id, value in values.items():
        if not isinstance(id, Coefficient):
            effects.setdefault(id.effect, {})[id.name] = value
    return replace(moved, effects=effects)


def validity_of(problem: SeriesProblem | WholeRunProblem | TableProblem) -> dict[str, Any]:
    """The data behind a fit: their name, runs or conditions, and ranges (lowest, highest), SI."""
    if isinstance(problem, TableProblem):
        table = problem.table
        columns = dict(zip(COMMANDS, table.commands.T, strict=True))
        for k, name in enumerate(table.observations):
            columns[name] = table.values[table.present[:, k], k]
        return {"dataset": table.name, "conditions": list(table.conditions), **_ranges(columns)}
    runs = [problem.dataset.run(id) for id in problem.run_ids]
    commands = np.concatenate([run.commands.values for run in runs])
    columns = dict(zip(COMMANDS, commands.T, strict=True))
    for channel in problem.channels:
        columns[channel] = np.concatenate([run.channels[channel] for run in runs])
    return {
        "dataset": problem.dataset.name,
        "runs": [run.id for run in runs],
        **_ranges(columns),
    }


def _ranges(columns: Mapping[str, FloatArray]) -> dict[str, Any]:
    measured = {name: values[np.isfinite(values)] for name, values in columns.items()}
    return {"ranges": {n: [float(v.min()), float(v.max())] for n, v in measured.items() if v.size}}
