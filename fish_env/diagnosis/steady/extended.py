"""The extended model of a table as a fish."""

from __future__ import annotations

from typing import Any

from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.steady.fitting import SteadyFit
from fish_env.identification.writing import posterior_of, with_posterior
from fish_env.params.schema import FishParams


def identified_fish(fit: SteadyFit, name: str) -> FishParams:
    """The fish of a fit, with status ``identified``, its posterior and its range of validity."""
    table = fit.problem.table
    source = f"identified from {table.name}, {len(table.conditions)} conditions of steady motion"
    posterior = posterior_of(fit.names, fit.estimates, fit.covariance, validity(fit))
    return with_posterior(fit.problem.fish, posterior, name, source)


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
