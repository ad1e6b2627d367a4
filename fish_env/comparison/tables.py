"""Tables of steady motion: every row is simulated until steady and compared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.comparison.errors import plain, unit_of
from fish_env.data import COMMANDS, SteadyDataset
from fish_env.effects.extended import build_model
from fish_env.params import FishParams
from fish_env.steady import steady_motion

SMALL = 0.1
"""Percentages leave out values below this share of the largest measured one: near zero they say
nothing."""


@dataclass(frozen=True)
class ObservationComparison:
    """One observation over all rows; errors are simulated minus measured.

    Attributes:
        name: Name of the observation.
        measured: Shape (n,), SI, NaN where missing.
        simulated: Shape (n,), SI; NaN or infinite where the model has no such value.
        rows: Rows that entered the measures below.
        r_squared: 1 - sum of squared errors / sum of squares about the mean; negative where the
            model is worse than the mean of the measurements.
        mae: Mean absolute error.
        bias: Mean error.
        gain: Factor g for which g times the measured values comes closest to the simulated ones: 1
            is right, below 1 the model moves too little.
        percent_error: Mean of |error / measured| in percent over `percent_rows` rows.
        percent_rows: Rows whose measured value is not near zero.
        repeat_sd: Standard deviation between repeats of one condition, NaN without repeats.
        trend: Command (or its magnitude, ``|name|``) with which the error grows or falls most
            evenly, and Spearman's rank correlation of the two; None if none beyond 0.5.
    """

    name: str
    measured: FloatArray
    simulated: FloatArray
    rows: int
    r_squared: float
    mae: float
    bias: float
    gain: float
    percent_error: float
    percent_rows: int
    repeat_sd: float
    trend: tuple[str, float] | None

    @property
    def error(self) -> FloatArray:
        """Simulated minus measured, shape (n,), NaN where either is missing."""
        return _difference(self.measured, self.simulated)


@dataclass(frozen=True)
class SteadyComparison:
    """A table of steady motion, measured and simulated.

    Attributes:
        dataset: Name of the dataset.
        fish: Name of the simulated fish.
        effects: Effects that were on, with their values.
        ids: Name of each row.
        conditions: Name that repeats share, for each row; a row without one has its own id.
        commands: Shape (n, 5), SI.
        observations: By name.
        unsteady: Rows whose simulation did not become steady.
        notes: What reading the dataset left aside or converted.
    """

    dataset: str
    fish: str
    effects: Mapping[str, Mapping[str, float]]
    ids: tuple[str, ...]
    conditions: tuple[str, ...]
    commands: FloatArray
    observations: Mapping[str, ObservationComparison]
    unsteady: tuple[str, ...]
    notes: tuple[str, ...]

    def worst(self, name: str, count: int = 3) -> list[tuple[str, float, float, float]]:
        """Conditions with the largest errors of an observation.

        Returns:
            Condition, mean error, mean measured and mean simulated value; largest error first.
        """
        observation = self.observations[name]
        rows = []
        for condition in dict.fromkeys(self.conditions):
            inside = np.array([c == condition for c in self.conditions])
            inside &= np.isfinite(observation.error)
            if inside.any():
                series = (observation.error, observation.measured, observation.simulated)
                error, measured, simulated = (float(s[inside].mean()) for s in series)
                rows.append((condition, error, measured, simulated))
        return sorted(rows, key=lambda row: -abs(row[1]))[:count]

    def as_dict(self) -> dict[str, Any]:
        """Everything, ready for JSON."""
        names = self.observations
        worst = {name: [list(row) for row in self.worst(name, len(self.ids))] for name in names}
        return plain(self) | {  # type: ignore[no-any-return]
            "kind": "steady",
            "units": {name: unit_of(name) for name in names},
            "errors_by_condition": worst,
        }


def compare_steady(dataset: SteadyDataset, fish: FishParams, dt: float = 0.01) -> SteadyComparison:
    """Simulates every row of a table of steady motion, all at once.

    Args:
        dataset: The measured table.
        fish: Parameters, with the effects in their file.
        dt: Physics step, s.
    """
    tolerance = 1e-3
    model = build_model(fish)
    motion = steady_motion(model, dataset.commands, dt=dt, tolerance=tolerance)
    unsteady = ~(motion["change"] < tolerance)
    conditions = tuple(c or i for c, i in zip(dataset.conditions, dataset.ids, strict=True))
    observations = {
        name: _observation(name, values, motion[name], conditions, dataset.commands)
        for name, values in dataset.observations.items()
    }
    return SteadyComparison(
        dataset=dataset.name,
        fish=fish.name,
        effects=model.effects,
        ids=dataset.ids,
        conditions=conditions,
        commands=dataset.commands,
        observations=observations,
        unsteady=tuple(i for i, bad in zip(dataset.ids, unsteady, strict=True) if bad),
        notes=dataset.notes,
    )


def _difference(measured: FloatArray, simulated: FloatArray) -> FloatArray:
    error = simulated - measured
    return np.where(np.isfinite(error), error, np.nan)


def _observation(
    name: str,
    measured: FloatArray,
    simulated: FloatArray,
    conditions: tuple[str, ...],
    commands: FloatArray,
) -> ObservationComparison:
    error = _difference(measured, simulated)
    used = np.isfinite(error)
    truth, miss = measured[used], error[used]
    large = np.abs(truth) > SMALL * np.max(np.abs(truth), initial=0.0)
    spread = float(np.sum((truth - truth.mean()) ** 2)) if used.any() else 0.0
    return ObservationComparison(
        name=name,
        measured=measured,
        simulated=simulated,
        rows=int(used.sum()),
        r_squared=1.0 - float(np.sum(miss**2)) / spread if spread > 0.0 else math.nan,
        mae=_mean(np.abs(miss)),
        bias=_mean(miss),
        gain=_gain(truth, truth + miss),
        percent_error=100.0 * _mean(np.abs(miss[large] / truth[large])),
        percent_rows=int(large.sum()),
        repeat_sd=_repeat_sd(measured, conditions),
        trend=_trend(error, commands),
    )


def _gain(measured: FloatArray, simulated: FloatArray) -> float:
    squares = float(np.sum(measured**2))
    return float(np.sum(measured * simulated)) / squares if squares > 0.0 else math.nan


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if values.size else math.nan


def _repeat_sd(values: FloatArray, conditions: tuple[str, ...]) -> float:
    """Pooled standard deviation within conditions."""
    squares, freedom = 0.0, 0
    for condition in set(conditions):
        inside = np.array([c == condition for c in conditions]) & np.isfinite(values)
        group = values[inside]
        squares += float(np.sum((group - group.mean()) ** 2)) if group.size else 0.0
        freedom += max(0, group.size - 1)
    return math.sqrt(squares / freedom) if freedom else math.nan


def _trend(error: FloatArray, commands: FloatArray) -> tuple[str, float] | None:
    from scipy.stats import spearmanr  # a third of a second to load, for nobody else's use

    used = np.isfinite(error)
    found: list[tuple[str, float]] = []
    for column, name in enumerate(COMMANDS):
        for label, values in ((name, commands[:, column]), (f"|{name}|", abs(commands[:, column]))):
            varied = used.sum() > 2 and np.ptp(values[used]) > 0.0 and np.ptp(error[used]) > 0.0
            if varied and (label == name or commands[:, column].min() < 0.0):
                found.append((label, float(spearmanr(values[used], error[used]).statistic)))
    best = max(found, key=lambda item: abs(item[1]), default=("", 0.0))
    return best if abs(best[1]) > 0.5 else None
