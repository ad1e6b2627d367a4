"""``diagnose_steady``: from a table of steady motion to a verdict with numbers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data import split_runs
from fish_env.data.schema import SteadyDataset
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.next_experiment import Proposal
from fish_env.diagnosis.preconditions import Precondition
from fish_env.diagnosis.report import write_report
from fish_env.diagnosis.report.steady import steady_series_from
from fish_env.diagnosis.steady.adequacy import Adequacy, adequacy
from fish_env.diagnosis.steady.answer import as_dict
from fish_env.diagnosis.steady.attribution import Attribution, attribute, explained
from fish_env.diagnosis.steady.experiment import propose
from fish_env.diagnosis.steady.extended import identified_fish
from fish_env.diagnosis.steady.fitting import SteadyFit, fit
from fish_env.diagnosis.steady.judging import measure_gain, misfit_of
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.profile import profiled
from fish_env.diagnosis.steady.screening import causes_of, needs_place_or_time
from fish_env.diagnosis.steady.showing import preconditions
from fish_env.diagnosis.steady.table import IntArray, Table, table_of
from fish_env.diagnosis.verdict import Verdict, verdict_of
from fish_env.diagnosis.writing import EXTENDING, write_answer
from fish_env.errors import DatasetError
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams

Progress = Callable[[str], None]
FEWEST_CONDITIONS = 3
FEWEST_FOR_FINAL = 6
"""Conditions a table must have before a fifth of them are kept for judging."""
SEEN = 1.0 / 3.0
"""Share of the catalogue that a table must be able to show before it may say that nothing is
wrong. No table shows more than about three fifths: delays, transients, places and times leave
averages as they are."""
ABSENT = (
    "effects that depend on place, heading or time cannot be told from averages of steady motion "
    "and were left out: {names}"
)


@dataclass(frozen=True, eq=False)
class SteadyDiagnosis:
    """Everything a diagnosis of a table found.

    Attributes:
        dataset: the measured table.
        attribution: search among causes.
        adequacy: whether the accepted explanation reaches the floor.
        shown: what the table could show.
        verdict: the answer.
        misfit: whitened errors by observation, baseline and accepted.
        gain: on the final conditions; None without an extension or without such conditions.
        next_experiment: what separates what is still open; None where nothing is.
        notes: for the user.
        seed: of splits and null distributions.
        quick: whether fewer causes were refitted.
        runtime_s: wall time.
    """

    dataset: SteadyDataset
    attribution: Attribution
    adequacy: Adequacy
    shown: tuple[Precondition, ...]
    verdict: Verdict
    misfit: dict[str, Pair]
    gain: Gain | None
    next_experiment: Proposal | None
    notes: tuple[str, ...]
    seed: int
    quick: bool
    runtime_s: float

    @property
    def accepted(self) -> SteadyFit:
        """The accepted fit: extended, or the refitted baseline."""
        return self.attribution.accepted.fit


def diagnose_steady(
    dataset: SteadyDataset,
    fish: FishParams | None = None,
    *,
    seed: int = 0,
    quick: bool = False,
    progress: Progress = lambda step: None,
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
    progress: Progress,
) -> SteadyDiagnosis:
    """Diagnose a table, with everything found on the way (see :func:`diagnose_steady`)."""
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    table = table_of(dataset)
    if len(table.conditions) < FEWEST_CONDITIONS:
        raise DatasetError(
            f"{dataset.name}: {len(table.conditions)} condition(s) cannot tell one cause from "
            f"another; measure at least {FEWEST_CONDITIONS}"
        )
    whole = SteadyProblem(table, fish or load_fish(dataset.fish))
    fitted, final = split_conditions(dataset, table, seed)
    progress("refitting the baseline")
    baseline = fit(whole.on(fitted))
    progress("what the table could show")
    every = [c for c in causes_of(whole) if c.is_effect]
    absent = needs_place_or_time(baseline, [c.name for c in every])
    causes = [c for c in causes_of(whole) if c.name not in absent]
    progress("screening causes")
    attribution = attribute(baseline, causes, rng, 3 if quick else 6, progress)
    progress("how far the causes may go")
    attribution = with_intervals(attribution)
    names = [c.name for c in every]
    shown = preconditions(whole, attribution.screens[0], names)
    progress("testing what is left")
    accepted = attribution.accepted.fit
    left = adequacy(accepted, rng)
    verdict = decide(attribution, left, shown)
    gain = None
    if verdict.name in EXTENDING and len(final):
        progress("measuring the gain on final conditions")
        gain = measure_gain(whole.on(final), attribution.baseline.fit, accepted, rng)
    progress("choosing the next experiment")
    return SteadyDiagnosis(
        dataset, attribution, left, shown, verdict,
        misfit_of(attribution.baseline.fit, accepted), gain, propose(attribution, verdict, shown),
        _notes(dataset, left, accepted, absent), seed, quick, time.perf_counter() - begin,
    )  # fmt: skip


def with_intervals(attribution: Attribution) -> Attribution:
    """The attribution with likelihood intervals of the accepted effects, and their best fit."""
    accepted = attribution.accepted
    if not accepted.fit.effects:
        return attribution
    return replace(attribution, accepted=explained(accepted.causes, profiled(accepted.fit)))


def decide(attribution: Attribution, left: Adequacy, shown: tuple[Precondition, ...]) -> Verdict:
    """Choose the verdict; an explanation that does not reach the floor names nothing."""
    return verdict_of(
        left.reached,
        attribution.accepted.causes,
        tuple(rival.causes for rival in attribution.rivals),
        sum(p.excited for p in shown) < SEEN * len(shown),
    )


def split_conditions(dataset: SteadyDataset, table: Table, seed: int) -> tuple[IntArray, IntArray]:
    """Conditions to fit and select on, and a fifth for judging where there are enough.

    Among the first, each is left out in turn to select, so none is set apart for that.
    """
    count = len(table.conditions)
    if count < FEWEST_FOR_FINAL:
        return np.arange(count), np.arange(0)
    named = replace(dataset, conditions=tuple(table.conditions[i] for i in table.condition_of))
    split = split_runs(named, seed, (0.8, 0.0, 0.2), by="condition")
    rows = [table.ids.index(i) for i in split.final]
    final = np.unique(table.condition_of[rows])
    return np.setdiff1d(np.arange(count), final), final


def _notes(
    dataset: SteadyDataset, left: Adequacy, accepted: SteadyFit, absent: set[str]
) -> tuple[str, ...]:
    notes = list(dataset.notes)
    if absent:
        notes.append(ABSENT.format(names=", ".join(sorted(absent))))
    if left.ratio is None:
        notes.append(
            "too few repeats to say what the noise floor is: it is an assumption, taken from what "
            "the best fit leaves"
        )
    at_bound = [p for p in accepted.names if _at_bound(accepted, p)]
    if at_bound:
        notes.append(f"estimates at a bound: {', '.join(at_bound)}")
    return tuple(notes)


def _at_bound(fit: SteadyFit, path: str) -> bool:
    value = float(fit.estimates[fit.names.index(path)])
    low, high = fit.bounds(path)
    return bool(min(value - low, high - value) < 1e-3 * max(abs(value), 1e-9))


def _write(diagnosis: SteadyDiagnosis, answer: dict[str, Any], folder: Path) -> None:
    accepted = diagnosis.accepted
    extends = diagnosis.verdict.name in EXTENDING
    name = f"{accepted.problem.fish.name}-extended"
    write_answer(answer, identified_fish(accepted, name) if extends else None, folder)
    fits = diagnosis.attribution.baseline.fit, accepted
    final = diagnosis.gain.runs if diagnosis.gain else ()
    write_report(answer, steady_series_from(diagnosis.dataset, *fits, final), folder)
