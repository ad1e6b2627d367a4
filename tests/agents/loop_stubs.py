"""Stand-ins for the diagnosis: they read the truth that is kept beside the runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.params import save_fish
from fish_env.params.provenance import Posterior
from scripts.loop.measuring import true_fish
from tests.hidden.stubs import perfect
from tests.hidden.truth import Truth

SPREAD = 0.01
"""Relative standard deviation of everything in the posterior."""


def truth_of(runs: Path) -> Truth:
    return Truth.load(runs.parent / f"{runs.name}.truth.json")


def knowing(runs: Path, out: Path, seed: int = 0) -> dict[str, Any]:
    """Finds everything, and writes the extended model with a posterior."""
    truth = truth_of(runs)
    fish = true_fish(truth)
    values = {
        f"effects.{name}.{key}": value
        for name, effect in truth.effects.items()
        for key, value in effect.items()
    } | {"body.plane_xz.drag.c0": fish.get("body.plane_xz.drag.c0")}
    numbers = np.array(list(values.values()))
    covariance = tuple(map(tuple, np.diag((SPREAD * numbers) ** 2).tolist()))
    posterior = Posterior(tuple(values), tuple(numbers.tolist()), covariance)
    out.mkdir(parents=True)
    save_fish(replace(fish, name="extended", posterior=posterior), out / "extended.yaml")
    return perfect(truth)


def blind(runs: Path, out: Path, seed: int = 0) -> dict[str, Any]:
    """Finds nothing, and writes no extended model."""
    return {"verdict": "no_misfit", "causes": [], "alternatives": [], "runtime_s": 0.0}
