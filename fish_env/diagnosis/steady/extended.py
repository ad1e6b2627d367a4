"""The extended model of a table as a fish."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.steady.fitting import SteadyFit
from fish_env.effects.extended import PREFIX
from fish_env.params.provenance import Posterior
from fish_env.params.schema import FishParams


def identified_fish(fit: SteadyFit, name: str) -> FishParams:
    """The fish of a fit, with status ``identified``, its posterior and its range of validity."""
    baseline = fit.problem.baseline
    count = len(baseline)
    table = fit.problem.table
    values = dict(zip(baseline.paths, fit.estimates[:count].tolist(), strict=True))
    source = f"identified from {table.name}, {len(table.conditions)} conditions of steady motion"
    moved = fit.problem.fish.replace(values, "identified", source)
    effects = {effect: dict(known) for effect, known in moved.effects.items()}
    for path, value in fit.point.effects.items():
        effect, parameter = path.removeprefix(PREFIX).split(".")
        effects.setdefault(effect, {})[parameter] = value
    covariance = 0.5 * (fit.covariance + fit.covariance.T)
    posterior = Posterior(
        fit.names,
        tuple(fit.estimates.tolist()),
        tuple(tuple(row) for row in covariance.tolist()),
        validity(fit),
    )
    return replace(moved, name=name, effects=effects, posterior=posterior, source_file=None)


def validity(fit: SteadyFit) -> dict[str, Any]:
    """Conditions behind the estimates, and the ranges of their commands and averages."""
    table = fit.problem.table
    ranges = {
        name: [float(column.min()), float(column.max())]
        for name, column in zip(COMMANDS, table.commands.T, strict=True)
    }
    for k, name in enumerate(table.observations):
        seen = table.values[table.present[:, k], k]
        ranges[name] = [float(seen.min()), float(seen.max())]
    return {"dataset": table.name, "conditions": list(table.conditions), "ranges": ranges}
