"""A fish from a dataset in one call: fit, intervals, errors on what was left out, files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from fish_env.data import load_dataset
from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.effects import catalogue
from fish_env.errors import EffectError
from fish_env.files import write_text
from fish_env.identification.greedy import EffectStep, add_effects
from fish_env.identification.left_out import (
    RunErrors,
    groups_of,
    left_out_errors,
    mean_errors,
)
from fish_env.identification.objectives import (
    Objective,
    check_effects,
    objective_named,
)
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.progress import Report, silent
from fish_env.params.io import check_tables, load_fish, save_fish
from fish_env.params.schema import FishParams
from fish_env.version import versioned

AUTO = "auto"


@dataclass(frozen=True)
class Estimate:
    """One estimated parameter.

    Attributes:
        name: path of a coefficient, or ``effects.<effect>.<parameter>``.
        unit: SI.
        before: value in the fish's file; of an effect, where it does nothing beyond that file.
        value: estimate.
        low: lower end of the 95 % interval.
        high: upper end of the 95 % interval.
        prior_sds_off: how far it moved, in standard deviations of its prior; None of effects.
        at_bound: whether it ended at an end of its range.
    """

    name: str
    unit: str
    before: float
    value: float
    low: float
    high: float
    prior_sds_off: float | None
    at_bound: bool


@dataclass(frozen=True, eq=False)
class DatasetFit:
    """What a fit to a dataset has found.

    Attributes:
        dataset: name of the dataset.
        objective: ``one-step``, ``whole-run`` or ``means``.
        effects: effects that were fitted beside the coefficients.
        fit: the core's result.
        fish: the fitted fish, with its posterior.
        estimates: every free parameter with its interval.
        units: unit of each error.
        errors: errors of every run by the fit to all runs (SI).
        left_out: column that was left out, value by value; None if nothing was.
        held_out: errors of every run by a fit that has not seen its group (SI); empty if nothing
            was left out.
        steps: effects that were judged by what was left out, in order.
    """

    dataset: str
    objective: str
    effects: tuple[str, ...]
    fit: Fit = field(repr=False)
    fish: FishParams = field(repr=False)
    estimates: tuple[Estimate, ...]
    units: dict[str, str]
    errors: tuple[RunErrors, ...] = field(repr=False)
    left_out: str | None = None
    held_out: tuple[RunErrors, ...] = field(default=(), repr=False)
    steps: tuple[EffectStep, ...] = ()

    @property
    def unseen(self) -> tuple[str, ...]:
        """Effects that were asked for, of which the runs show no parameter."""
        free = {id.effect for id in self.fit.ids if not isinstance(id, Coefficient)}
        return tuple(name for name in self.effects if name not in free)

    @property
    def mean_errors(self) -> dict[str, float]:
        """Quantity -> mean absolute error of the fit to all runs, SI."""
        return mean_errors(self.errors)

    @property
    def mean_held_out(self) -> dict[str, float]:
        """Quantity -> mean absolute error on what was left out, SI; empty if nothing was."""
        return mean_errors(self.held_out)

    def as_dict(self) -> dict[str, Any]:
        """Everything but the fish, for a JSON file."""
        return {
            "dataset": self.dataset,
            "objective": self.objective,
            "effects": list(self.effects),
            "effects_unseen": list(self.unseen),
            "estimates": [asdict(e) for e in self.estimates],
            "units": self.units,
            "errors": self.mean_errors,
            "left_out": self.left_out,
            "held_out_errors": self.mean_held_out,
            "runs": [asdict(run) for run in self.errors],
            "held_out_runs": [asdict(run) for run in self.held_out],
            "effects_judged": [asdict(step) for step in self.steps],
        }

    def write(self, path: str | Path, results: str | Path | None = None) -> None:
        """Write the fitted fish, and what is known of the fit.

        Args:
            path: parameter file of the fish, which is called by the name of the file.
            results: JSON file for estimates and errors; None for none.

        Raises:
            OutputError: a file cannot be written, or a table would replace one of someone else.
        """
        check_tables(self.fish, path)
        save_fish(replace(self.fish, name=Path(path).stem), path)
        if results is not None:
            write_text(results, json.dumps(versioned(self.as_dict()), indent=1) + "\n")


def fit_dataset(
    dataset: str | Path | Dataset | SteadyDataset,
    fish: str | FishParams | None = None,
    *,
    objective: str | None = None,
    effects: Sequence[str] = (),
    leave_out: str | None = None,
    paths: Sequence[str] | None = None,
    report: Report = silent,
) -> DatasetFit:
    """Fit coefficients and effects of a fish to a dataset.

    Args:
        dataset: folder, name of a shipped dataset, or data in memory.
        fish: preset, file or parameters; default: the dataset's own.
        objective: what is minimised: ``one-step``, ``whole-run`` or ``means``; default: one-step
            errors of runs over time, errors of the means of a table of steady motion.
        effects: names of effects fitted beside the coefficients, or ``"auto"``: those of the
            catalogue are added one by one while they lower the held-out error.
        leave_out: ``condition``, ``run`` or a command: leave out each value of it in turn and
            report the errors on what was left out. ``"auto"`` needs it; its default is then
            ``condition``.
        paths: coefficients that are free; default: all with a prior that the data can show.
        report: told what is being done.

    Raises:
        DatasetError: the data do not suit the objective, or nothing can be left out.
        EffectError: an effect is unknown.
        ParameterError: the fish is unknown or impossible.
        LinAlgError: the simulation diverges at the start of the fit.
    """
    data = load_dataset(dataset) if isinstance(dataset, str | Path) else dataset
    own = load_fish(fish) if isinstance(fish, str) else fish
    chosen = objective_named(objective, data)
    greedy = effects == AUTO
    if isinstance(effects, str) and not greedy:
        raise EffectError(f"effects: give a list of names or 'auto', not {effects!r}")
    names: tuple[str, ...] = () if greedy else tuple(effects)
    check_effects(names)

    with threadpool_limits(1, "blas"):
        problem = chosen.problem(data, own, names, paths)
        column = "condition" if greedy and leave_out is None else leave_out
        groups = {} if column is None else groups_of(data, problem, column)
        found = chosen.fit(problem, None, report)
        held_out: tuple[RunErrors, ...] = ()
        steps: tuple[EffectStep, ...] = ()
        if greedy:
            found, held_out, steps = add_effects(chosen, found, groups, report)
        elif groups:
            held_out = left_out_errors(chosen, found, groups, report)
        report("judging the fit")
        return _result(data.name, chosen, found, column, held_out, steps)


def _result(
    name: str,
    objective: Objective,
    found: Fit,
    column: str | None,
    held_out: tuple[RunErrors, ...],
    steps: tuple[EffectStep, ...],
) -> DatasetFit:
    problem = found.problem
    own = objective.errors(problem, found)
    errors = tuple(RunErrors(i, None, e) for i, e in zip(problem.run_ids, own, strict=True))
    estimates = [_estimate(found, i) for i in range(len(found.ids))]
    units = {quantity: objective.unit(quantity) for quantity in mean_errors(errors)}
    return DatasetFit(
        name, objective.name, found.effects, found, objective.fish(found, f"{name}-identified"),
        tuple(estimates), units, errors, column, held_out, steps,
    )  # fmt: skip


def _estimate(found: Fit, i: int) -> Estimate:
    id, value = found.ids[i], float(found.estimates[i])
    low, high = found.interval(id)
    baseline, known = found.problem.baseline, catalogue()
    moved = None
    if isinstance(id, Coefficient):
        at = baseline.ids.index(id)
        lower, upper = (float(bound[at]) for bound in baseline.bounds)
        unit, before = baseline.unit(id), float(baseline.mean[at])
        moved = (value - before) / float(baseline.sd[at])
    else:
        parameter = next(p for p in known[id.effect].parameters if p.name == id.name)
        lower, upper, unit = parameter.lower, parameter.upper, parameter.unit
        before = found.problem.neutral([id.effect])[id]
    low, high = max(low, lower), min(high, upper)
    return Estimate(str(id), unit, before, value, low, high, moved, id in found.at_bounds)
