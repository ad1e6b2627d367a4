"""``diagnose_steady``: from a table of steady motion to a verdict with numbers."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fish_env.arrays import IntArray
from fish_env.data import split_runs
from fish_env.data.schema import SteadyDataset
from fish_env.diagnosis.next_experiment import plausible_sizes
from fish_env.diagnosis.policy import CHECKS
from fish_env.diagnosis.report import write_report
from fish_env.diagnosis.report.steady import steady_series_from
from fish_env.diagnosis.result import TableDiagnosis
from fish_env.diagnosis.tables.answer import as_dict
from fish_env.diagnosis.tables.experiment import propose
from fish_env.diagnosis.tables.gain import measure_gain, misfit_of
from fish_env.diagnosis.writing import write_answer
from fish_env.errors import DatasetError
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import Table, table_of
from fish_env.identification.writing import identified_fish
from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.effort import effort_of
from fish_env.inference.estimate.again import finished
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.profile import profiled
from fish_env.inference.explanation import Explanation
from fish_env.inference.pipeline import investigate, refit_baseline
from fish_env.inference.preconditions import unseen
from fish_env.inference.probes import causes_of
from fish_env.inference.progress import Report, silent
from fish_env.inference.verdict import EXTENDING
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams

ABSENT = (
    "left out, because this table cannot show effects that depend on place, heading or time, or "
    "that do not change averages: {names}"
)


def diagnose_steady(
    dataset: SteadyDataset,
    fish: FishParams | None = None,
    *,
    seed: int = 0,
    quick: bool = False,
    progress: Report = silent,
    out: Path | None = None,
) -> dict[str, Any]:
    """Diagnose a table of steady motion.

    Args:
        dataset: measured averages.
        fish: parameters; default: the dataset's own.
        seed: of the split and of the null distributions.
        quick: refit fewer causes.
        progress: told the name of each step.
        out: folder for ``diagnosis.json``, ``report.html`` with its figures and, where there is
            something to extend, ``extended.yaml``; nothing is written without it.

    Returns:
        The content of ``diagnosis.json``.

    Raises:
        DatasetError: no diagnosis should be built on this table.
    """
    with threadpool_limits(1, "blas"):
        diagnosis = diagnose_table(dataset, fish, seed, quick, progress)
        answer = as_dict(diagnosis)
        if out is not None:
            _write(diagnosis, answer, out)
    return answer


def diagnose_table(
    dataset: SteadyDataset,
    fish: FishParams | None,
    seed: int,
    quick: bool,
    progress: Report,
) -> TableDiagnosis:
    """Diagnose a table, with everything found on the way (see :func:`diagnose_steady`)."""
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    table = table_of(dataset)
    _check(table)
    whole = TableProblem(table, fish or load_fish(dataset.fish))
    fitted, final = split_conditions(dataset, table, seed)
    problem = whole.on(fitted)
    progress("refitting the baseline")
    baseline = refitted(problem)
    absent = untold(problem, baseline)
    causes = [c for c in causes_of(problem) if c.id not in absent]
    held_out = whole.on(final) if len(final) else None
    found = investigate(baseline, causes, rng, effort_of(quick), progress, held_out)
    progress("computing intervals of the causes")
    attribution, verdict = with_intervals(found.attribution), found.verdict
    fits = baseline, attribution.accepted.fit
    shown = (*found.preconditions, *(unseen(name) for name in sorted(absent)))
    gain = None
    if found.gap is not None and held_out is not None:
        gain = measure_gain(held_out, fits, found.gap)
    progress("choosing the next experiment")
    return TableDiagnosis(
        dataset=dataset, problem=problem, attribution=attribution, adequacy=found.adequacy,
        preconditions=shown, verdict=verdict, misfit=misfit_of(problem, fits, fits[1].noise),
        gain=gain, next_experiment=propose(problem, attribution, verdict, shown),
        notes=_notes(dataset, found.adequacy, fits[1], absent), budget=found.budget,
        seed=seed, quick=quick, runtime_s=time.perf_counter() - begin,
    )  # fmt: skip


def _check(table: Table) -> None:
    if len(table.conditions) < CHECKS.fewest_conditions:
        raise DatasetError(
            f"{table.name}: {len(table.conditions)} condition(s) are too few to distinguish "
            f"causes; measure at least {CHECKS.fewest_conditions}"
        )


def refitted(problem: TableProblem) -> Fit:
    """The refitted baseline.

    The first noise is a guess, under which the fit may have gone to a minimum far away: under the
    noise that it leaves, the fit begins once more from the nominal coefficients.

    Raises:
        DatasetError: the fish does not come to steady motion.
    """
    try:
        first = refit_baseline(problem)
        again = fit(problem, noise=first.noise, refit_noise=False)
    except np.linalg.LinAlgError:
        raise problem.not_steady() from None
    if again.objective >= first.objective:
        return first
    return finished(fit(problem, start=again.point, noise=again.noise))


def untold(problem: TableProblem, baseline: Fit) -> set[str]:
    """Effects that these averages can tell nothing of, were they as strong as is plausible."""
    searched = {name: effect for name, effect in problem.known.items() if effect.diagnosed}
    settings = {name: plausible_sizes(effect) for name, effect in searched.items()}
    return problem.untold(baseline.point, baseline.noise, settings)


def with_intervals(attribution: Attribution) -> Attribution:
    """The attribution with likelihood intervals of the accepted effects, and their best fit."""
    accepted = attribution.accepted
    if not accepted.fit.effects:
        return attribution
    return replace(attribution, accepted=Explanation(accepted.causes, profiled(accepted.fit)))


def split_conditions(dataset: SteadyDataset, table: Table, seed: int) -> tuple[IntArray, IntArray]:
    """Conditions to fit and select on, and a fifth for held_out where there are enough.

    Among the first, each is left out in turn to select, so none is set apart for that.
    """
    count = len(table.conditions)
    if count < CHECKS.fewest_for_held_out_conditions:
        return np.arange(count), np.arange(0)
    named = replace(dataset, conditions=tuple(table.conditions[i] for i in table.condition_of))
    share = CHECKS.held_out_conditions
    split = split_runs(named, seed, (1.0 - share, 0.0, share), by="condition")
    rows = [table.ids.index(i) for i in split.final]
    final = np.unique(table.condition_of[rows])
    return np.setdiff1d(np.arange(count), final), final


def _notes(
    dataset: SteadyDataset, left: Adequacy, accepted: Fit, absent: set[str]
) -> tuple[str, ...]:
    notes = list(dataset.notes)
    if absent:
        notes.append(ABSENT.format(names=", ".join(sorted(absent))))
    if left.lack is None:
        notes.append(
            "too few repeats to estimate the noise floor: it is assumed to equal the residual of "
            "the best fit"
        )
    if accepted.at_bounds:
        notes.append(f"estimates at a bound: {', '.join(map(str, accepted.at_bounds))}")
    return tuple(notes)


def _write(diagnosis: TableDiagnosis, answer: dict[str, Any], folder: Path) -> None:
    accepted = diagnosis.accepted
    extends = diagnosis.verdict.name in EXTENDING
    extended = identified_fish(accepted) if extends else None
    write_answer(answer, extended, folder)
    fits = diagnosis.attribution.baseline.fit, accepted
    final = diagnosis.gain.runs if diagnosis.gain else ()
    series = steady_series_from(diagnosis.dataset, diagnosis.problem, *fits, final)
    write_report(answer, series, folder)
