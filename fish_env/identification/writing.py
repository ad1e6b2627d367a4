"""A fit as a fish: values, where they come from, and how surely they are known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.extended import PREFIX
from fish_env.identification.series import series_of
from fish_env.inference.estimate.fit import Fit
from fish_env.params.provenance import Posterior
from fish_env.params.schema import FishParams


def identified_fish(fit: Fit, name: str) -> FishParams:
    """The fish of a fit, with status ``identified`` and its posterior.

    It loads wherever a fish does; its posterior can drive the environment's randomisation.

    Args:
        fit: result of an identification.
        name: name of the new fish.
    """
    problem = series_of(fit)
    source = f"identified from {problem.dataset.name}, {len(problem.runs)} runs"
    posterior = posterior_of(fit.names, fit.estimates, fit.covariance, validity(fit))
    return with_posterior(problem.fish, posterior, name, source)


def posterior_of(
    names: tuple[str, ...], estimates: FloatArray, covariance: FloatArray, valid: dict[str, Any]
) -> Posterior:
    """Estimates (n,) and covariance (n, n) as a parameter file keeps them."""
    symmetric = 0.5 * (covariance + covariance.T)
    rows = tuple(tuple(row) for row in symmetric.tolist())
    return Posterior(names, tuple(estimates.tolist()), rows, valid)


def with_posterior(fish: FishParams, posterior: Posterior, name: str, source: str) -> FishParams:
    """The fish at the posterior's estimates, under a new name, with status ``identified``."""
    values = dict(zip(posterior.names, posterior.mean, strict=True))
    coefficients = {p: v for p, v in values.items() if not p.startswith(PREFIX)}
    moved = fish.replace(coefficients, "identified", source)
    effects = {effect: dict(known) for effect, known in moved.effects.items()}
    for path in [p for p in values if p.startswith(PREFIX)]:
        effect, parameter = path.removeprefix(PREFIX).split(".")
        effects.setdefault(effect, {})[parameter] = values[path]
    return replace(moved, name=name, effects=effects, posterior=posterior, source_file=None)


def validity(fit: Fit) -> dict[str, Any]:
    """Ranges of the motion and of the commands behind a fit, (lowest, highest), SI."""
    states = np.concatenate([f.states for f in fit.filtered])
    commands = np.concatenate([run.commands[1] for run in series_of(fit).runs])
    rows = {"surge": 7, "sway": 8, "heave": 9, "depth": 2, "roll_rate": 10, "pitch_rate": 11}
    rows["yaw_rate"] = 12
    ranges: dict[str, Any] = {name: _range(states[:, row]) for name, row in rows.items()}
    names = ("tail_offset", "tail_amplitude", "tail_frequency", "block_displacement", "block_angle")
    ranges |= {name: _range(commands[:, i]) for i, name in enumerate(names)}
    return ranges


def _range(values: Any) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]
