"""What a fit minimises, by name: one-step errors, whole-run errors, or errors of steady means.

Each objective makes a :class:`Problem` of a dataset, fits it with the core, and says in SI units
how far the fit is off on runs it was not fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.effects import catalogue
from fish_env.errors import DatasetError, EffectError
from fish_env.identification.channels import BY_NAME
from fish_env.identification.series import SeriesProblem
from fish_env.identification.starts import likely_start
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import UNITS, table_of
from fish_env.identification.whole_runs import fitting, prediction
from fish_env.identification.whole_runs.problem import WholeRunProblem
from fish_env.identification.writing import identified_fish
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams

Errors = dict[str, float]
"""Quantity -> mean absolute error of a run, SI."""
STEPS = 4
"""Most Gauss-Newton steps of a fit that begins at one close by."""
CLOSE = 0.03
"""Its tolerance, in standard errors: one run of R less moves estimates by about 1 / sqrt(R) of one.
With the usual tolerance the fit could end where it has begun, having seen what is left out."""


class Objective(Protocol):
    """How a dataset is fitted and judged."""

    name: str
    runs_are: str
    """What an entry of :meth:`Problem.run_ids` stands for: ``run`` or ``condition``."""

    def problem(
        self, dataset: Any, fish: FishParams | None, effects: Sequence[str], paths: Any
    ) -> Any:
        """The problem of a dataset."""
        ...

    def fit(self, problem: Any, start: Point | None, report: Report) -> Fit:
        """Fit a problem, from a start far off unless a point close by is given."""
        ...

    def errors(self, problem: Any, fit: Fit) -> list[Errors]:
        """Mean absolute errors (SI) of predictions of each run of a problem."""
        ...

    def unit(self, quantity: str) -> str:
        """SI unit of a quantity of :meth:`errors`."""
        ...

    def fish(self, fit: Fit, name: str) -> FishParams:
        """The fish of a fit."""
        ...


class OneStep:
    """Errors of predictions to the next sample by a Kalman filter, which follows disturbances."""

    name = "one-step"
    runs_are = "run"

    def problem(
        self,
        dataset: Dataset | SteadyDataset,
        fish: FishParams | None,
        effects: Sequence[str],
        paths: Sequence[str] | None,
    ) -> SeriesProblem:
        """The runs behind a filter."""
        return SeriesProblem(_runs(dataset, self.name), fish, paths=paths, effects=effects)

    def fit(self, problem: SeriesProblem, start: Point | None, report: Report) -> Fit:
        """Fit coefficients, effects and noise."""
        report("searching for initial values")
        begin = start or likely_start(problem, problem.effects)
        return fit(problem, start=begin, report=report)

    def errors(self, problem: SeriesProblem, fit: Fit) -> list[Errors]:
        """Of each run and channel, how far the next sample is off."""
        settled, _ = evaluated(problem, fit.point, fit.noise)
        found = []
        for run, f in zip(
            settled.runs, settled.filtered(fit.point, fit.noise, keep_slopes=True), strict=True
        ):
            assert f.slopes is not None
            away = np.where(np.isfinite(run.measured), np.abs(f.slopes.raw), np.nan)
            found.append(_means(problem.channels, away))
        return found

    def unit(self, quantity: str) -> str:
        """SI unit of a channel."""
        return BY_NAME[quantity].unit

    def fish(self, fit: Fit, name: str) -> FishParams:
        """The fish of a fit."""
        return identified_fish(fit, name)


class WholeRun:
    """Errors of simulations from the start of each run to its end."""

    name = "whole-run"
    runs_are = "run"

    def problem(
        self,
        dataset: Dataset | SteadyDataset,
        fish: FishParams | None,
        effects: Sequence[str],
        paths: Sequence[str] | None,
    ) -> WholeRunProblem:
        """The runs, simulated from start to end."""
        return WholeRunProblem(_runs(dataset, self.name), fish, paths=paths, effects=effects)

    def fit(self, problem: WholeRunProblem, start: Point | None, report: Report) -> Fit:
        """Fit coefficients, effects, the size of errors, and each run's start and frequency."""
        return fitting.fit_whole_runs(problem, start, report)

    def errors(self, problem: WholeRunProblem, fit: Fit) -> list[Errors]:
        """Of each run, errors of its prediction from its first seconds."""
        return [p.errors for p in prediction.prediction_errors(problem, fit)]

    def unit(self, quantity: str) -> str:
        """SI unit of a channel, of ``path`` or of a mean over the second half."""
        return prediction.unit_of(quantity)

    def fish(self, fit: Fit, name: str) -> FishParams:
        """The fish of a fit."""
        return identified_fish(fit, name)


class Means:
    """Errors of averages over a beat of steady motion."""

    name = "means"
    runs_are = "condition"

    def problem(
        self,
        dataset: Dataset | SteadyDataset,
        fish: FishParams | None,
        effects: Sequence[str],
        paths: Sequence[str] | None,
    ) -> TableProblem:
        """The conditions of a table."""
        if not isinstance(dataset, SteadyDataset):
            raise DatasetError(
                f"{dataset.name}: runs over time; --objective means needs a table of steady "
                "motion. Use --objective one-step or whole-run"
            )
        problem = TableProblem(table_of(dataset), fish or load_fish(dataset.fish), paths)
        problem.effects = tuple(effects)
        return problem

    def fit(self, problem: TableProblem, start: Point | None, report: Report) -> Fit:
        """Fit coefficients, effects and scatter."""
        return fit(problem, start=start, report=report)

    def errors(self, problem: TableProblem, fit: Fit) -> list[Errors]:
        """Of each condition and observation, how far its mean is off."""
        (simulated,) = problem.means(problem.orbits(fit.point))
        table, found = problem.table, []
        for i, values in enumerate(simulated):
            rows = table.values[table.condition_of == i]
            found.append(_means(table.observations, np.abs(rows - values)))
        return found

    def unit(self, quantity: str) -> str:
        """SI unit of an observation."""
        return UNITS[quantity]

    def fish(self, fit: Fit, name: str) -> FishParams:
        """The fish of a fit."""
        return identified_fish(fit, name)


OBJECTIVES: dict[str, Objective] = {o.name: o for o in (OneStep(), WholeRun(), Means())}


def objective_named(name: str | None, dataset: Dataset | SteadyDataset) -> Objective:
    """The objective of a name; default: ``means`` of a table, ``one-step`` of runs over time.

    Raises:
        DatasetError: there is none of that name.
    """
    if name is None:
        return OBJECTIVES["means" if isinstance(dataset, SteadyDataset) else "one-step"]
    if name not in OBJECTIVES:
        raise DatasetError(f"--objective {name}: choose one of {', '.join(OBJECTIVES)}")
    return OBJECTIVES[name]


def check_effects(names: Sequence[str]) -> None:
    """Refuse effects that the catalogue does not have, and ones given twice.

    Raises:
        EffectError: names them and those there are.
    """
    unknown = [name for name in names if name not in catalogue()]
    if unknown:
        raise EffectError(f"unknown effects {unknown}; known: {', '.join(catalogue())}")
    if len(set(names)) < len(names):
        raise EffectError(f"effects {', '.join(names)}: name each once")


def refit(objective: Objective, near: Fit, problem: Problem) -> Fit:
    """A fit of the same effects to other runs, from the estimates of one close by.

    The noise model stays: it says how errors are weighed, not what the fish does.

    Args:
        objective: of both fits.
        near: fit whose estimates it begins from.
        problem: the other runs, with the same effects.
    """
    noise = problem.noise_of(near)
    return fit(
        problem, near.effects, near.point, noise, refit_noise=False, iterations=STEPS,
        tolerance=CLOSE,
    )  # fmt: skip


def _runs(dataset: Dataset | SteadyDataset, objective: str) -> Dataset:
    if isinstance(dataset, SteadyDataset):
        raise DatasetError(
            f"{dataset.name}: a table of steady motion; --objective {objective} needs runs over "
            "time. Use --objective means"
        )
    return dataset


def _means(names: Sequence[str], away: FloatArray) -> Errors:
    """Name -> mean of each column (T, C), those without any value left out."""
    good = np.isfinite(away)
    return {n: float(away[good[:, i], i].mean()) for i, n in enumerate(names) if good[:, i].any()}
