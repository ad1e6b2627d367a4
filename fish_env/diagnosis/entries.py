"""Entries of ``diagnosis.json`` that runs and tables of steady motion share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.causes import PARAMETER
from fish_env.effects.extended import PREFIX
from fish_env.identification.parameters import Baseline
from fish_env.model.effect import Effect
from fish_env.params.schema import FishParams

Plain = dict[str, Any]


class Identifiable(Protocol):
    """What is read of a problem."""

    fish: FishParams
    known: dict[str, Effect]
    baseline: Baseline


class Identified(Protocol):
    """What is read of a fit, whatever it was fitted to."""

    @property
    def problem(self) -> Identifiable:
        """What was fitted."""

    @property
    def names(self) -> tuple[str, ...]:
        """Free parameters, (n,), baseline paths first."""

    @property
    def estimates(self) -> npt.NDArray[np.float64]:
        """(n,) in physical units."""

    def interval(self, name: str, /) -> tuple[float, float]:
        """95 % interval of one of them."""


def cause_entry(fit: Identified, name: str) -> Plain:
    """A cause with its parameters: estimate, interval, unit."""
    if name.startswith(PARAMETER):
        path = name.removeprefix(PARAMETER)
        units: Mapping[str, tuple[str, str]] = {"value": (path, fit.problem.fish.info(path).unit)}
    else:
        parameters = fit.problem.known[name].parameters
        units = {p.name: (f"{PREFIX}{name}.{p.name}", p.unit) for p in parameters}
    return {
        "name": name,
        "parameters": {key: _estimate(fit, path, unit) for key, (path, unit) in units.items()},
    }


def _estimate(fit: Identified, path: str, unit: str) -> Plain:
    value = float(fit.estimates[fit.names.index(path)])
    return {"estimate": value, "ci95": list(fit.interval(path)), "unit": unit}


def coefficient_entries(fit: Identified) -> list[Plain]:
    """Every baseline coefficient: nominal, estimated, and how surprising under its prior."""
    baseline = fit.problem.baseline
    return [
        {
            "name": f"{PARAMETER}{path}",
            "nominal": float(baseline.mean[i]),
            "estimate": float(fit.estimates[i]),
            "ci95": list(fit.interval(path)),
            "prior_sd": float(baseline.sd[i]),
            "prior_sds_off": float((fit.estimates[i] - baseline.mean[i]) / baseline.sd[i]),
            "unit": fit.problem.fish.info(path).unit,
        }
        for i, path in enumerate(baseline.paths)
    ]
