"""``diagnose``: from a folder of measured runs to a verdict with numbers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fish_env.data import Dataset, load_dataset, split_runs
from fish_env.diagnosis.adequacy import Adequacy, adequacy, implausible, strains
from fish_env.diagnosis.answer import as_dict
from fish_env.diagnosis.attribution import Attribution, attribute, extended
from fish_env.diagnosis.beats import with_measured_beats
from fish_env.diagnosis.causes import Cause, causes_of
from fish_env.diagnosis.consistency import Consistency, check_consistency
from fish_env.diagnosis.effort import FULL, effort_of
from fish_env.diagnosis.extended_file import extended_fish
from fish_env.diagnosis.gain import Gain, Pair, measure_gain, misfit_of, one_step
from fish_env.diagnosis.next_experiment import Proposal, propose
from fish_env.diagnosis.noise_floor import Floor, noise_floors
from fish_env.diagnosis.preconditions import Precondition, preconditions
from fish_env.diagnosis.regimes import Localisation, localise_fits
from fish_env.diagnosis.report import ReportSeries, series_from, write_report
from fish_env.diagnosis.residual_model import ResidualModel, residual_model
from fish_env.diagnosis.steady.pipeline import diagnose_steady
from fish_env.diagnosis.suitability import check_runs, divergence
from fish_env.diagnosis.verdict import Verdict, decide
from fish_env.diagnosis.writing import EXTENDING, write_answer
from fish_env.errors import DatasetError
from fish_env.identification.estimator import Fit, finished, fit
from fish_env.identification.problem import Problem
from fish_env.identification.side_by_side import both
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams

Progress = Callable[[str], None]
LENIENCE = float(np.log(10.0))
"""A cause ten times as likely by chance is believed where the misfit itself is beyond chance."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a diagnosis found.

    Attributes:
        dataset: the measured runs.
        final_runs: ids of the runs kept for judging.
        floors: noise of each channel, from the data alone.
        consistency: whether the channels agree among themselves.
        problem: the others.
        attribution: search among causes.
        adequacy: whether the accepted explanation reaches the floor.
        preconditions: what the runs could show.
        verdict: the answer.
        localisation: where in the regime the baseline's misfit sits.
        misfit: whitened one-step errors by channel, baseline and accepted.
        gain: on the final runs; None without an extension, or without final runs.
        residual: what no known cause explains, as a sum of simple wrenches, if it can be so told.
        next_experiment: manoeuvre that separates what is still open; None where nothing is.
        seed: seed of splits and null distributions.
        quick: whether this is a first look.
        runtime_s: wall time.
    """

    dataset: Dataset
    final_runs: tuple[str, ...]
    floors: tuple[Floor, ...]
    consistency: Consistency
    problem: Problem
    attribution: Attribution
    adequacy: Adequacy
    preconditions: tuple[Precondition, ...]
    verdict: Verdict
    localisation: Localisation
    misfit: dict[str, Pair]
    gain: Gain | None
    residual: ResidualModel | None
    next_experiment: Proposal | None
    seed: int
    quick: bool
    runtime_s: float

    @property
    def accepted(self) -> Fit:
        """The accepted fit: extended, or the refitted baseline."""
        return self.attribution.accepted.fit


def diagnose(
    folder: str | Path,
    out: str | Path | None = None,
    seed: int = 0,
    quick: bool = False,
    fish: FishParams | str | Path | None = None,
    progress: Progress | None = None,
    measured_beats: bool = False,
) -> dict[str, Any]:
    """Diagnose a folder of measured runs.

    Args:
        folder: folder with a dataset.yaml, or the name of a shipped dataset.
        out: folder for ``diagnosis.json``, ``report.html`` with its figures and, where there is
            something to extend, ``extended.yaml``; nothing is written without it.
        seed: of the split and of the null distributions.
        quick: a first look, which leaves out what :data:`~fish_env.diagnosis.effort.QUICK` says.
        fish: another fish than the dataset names: parameters, preset or file.
        progress: told the name of each step.
        measured_beats: take the tail's frequencies from the hull's swaying, not from the commands.

    Returns:
        The content of ``diagnosis.json``.

    Raises:
        DatasetError: the data cannot be read, or no diagnosis should be built on them.
        ParameterError: the fish cannot be used.
    """
    chosen = fish if isinstance(fish, FishParams) or fish is None else load_fish(fish)
    tell = progress or (lambda step: None)
    dataset = load_dataset(folder)
    if not isinstance(dataset, Dataset):
        if measured_beats:
            raise DatasetError(f"{folder}: means hold no beat; leave out --measured-beats")
        where = Path(out) if out is not None else None
        return diagnose_steady(dataset, chosen, seed=seed, quick=quick, progress=tell, out=where)
    if measured_beats:
        dataset = with_measured_beats(dataset)
    diagnosis = diagnose_runs(dataset, chosen, seed, quick, tell)
    answer = as_dict(diagnosis)
    if out is not None:
        tell("writing the report")
        write(diagnosis, answer, Path(out))
    return answer


def write(diagnosis: Diagnosis, answer: dict[str, Any], folder: Path) -> None:
    """Writes ``diagnosis.json``, ``report.html`` and, if something extends, ``extended.yaml``."""
    extends = diagnosis.verdict.name in EXTENDING
    extended = extended_fish(diagnosis.accepted, diagnosis.dataset) if extends else None
    write_answer(answer, extended, folder)
    write_report(answer, _series(diagnosis), folder)


def _series(diagnosis: Diagnosis) -> ReportSeries:
    return series_from(
        dataset=diagnosis.dataset,
        baseline=diagnosis.attribution.baseline.fit,
        accepted=diagnosis.accepted,
        final_runs=diagnosis.final_runs,
        localisation=diagnosis.localisation,
        most_runs=effort_of(diagnosis.quick).pictured,
    )


def diagnose_runs(
    dataset: Dataset,
    fish: FishParams | None = None,
    seed: int = 0,
    quick: bool = False,
    progress: Progress = lambda step: None,
) -> Diagnosis:
    """Diagnose time series.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own.
        seed: of the split and of the null distributions.
        quick: a first look, which leaves out what :data:`~fish_env.diagnosis.effort.QUICK` says.
        progress: told the name of each step.

    Raises:
        DatasetError: no diagnosis should be built on these runs.
    """
    # The filter has its own threads; those of the linear algebra would wait for each other.
    with threadpool_limits(1, "blas"):
        return _diagnose_runs(dataset, fish, seed, quick, progress)


def _diagnose_runs(
    dataset: Dataset, fish: FishParams | None, seed: int, quick: bool, progress: Progress
) -> Diagnosis:
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    effort = effort_of(quick)
    progress("checking the runs")
    check_runs(dataset)
    fitted, final = fitted_and_final(dataset, seed)
    problem = Problem(dataset, fish, fitted, dt=effort.step_s)
    problem = problem.subset(effort.runs).until(effort.seconds)
    progress("comparing the channels with each other")
    progress("refitting the baseline")
    compare = partial(_compared, dataset, seed)
    baseline, (floors, agreed) = both(partial(_refitted, problem), compare)
    problem = baseline.problem  # with the tail phases settled
    causes = causes_of(problem)
    progress("screening causes")
    attribution = attribute(problem, baseline, causes, rng, effort, progress)
    progress("what the runs could show")
    progress("testing what is left")
    where = None if quick else baseline
    left, shown = both(
        partial(adequacy, attribution.accepted.fit, rng, attribution.tolerated),
        partial(preconditions, problem, attribution.screens[0], causes, where),
    )
    judging = Problem(dataset, fish, final, dt=effort.step_s) if final else None
    residual = None
    if effort.retries and left.slight:
        left, residual = _judged_elsewhere(attribution, left, judging, progress)
    if effort.retries and not left.reached:
        attribution, left = _with_weaker_causes(attribution, left, causes, rng, progress)
    verdict = decide(attribution, left, shown)
    attribution = attribution.extrapolated()
    accepted = attribution.accepted.fit
    gain = None
    if verdict.name in EXTENDING and judging is not None:
        progress("measuring the gain on final runs")
        gain = measure_gain(judging, baseline, accepted, rng)
    if verdict.name != "outside_library":
        residual = None
    elif effort.retries and residual is None:
        progress("describing what is left")
        residual = _described(attribution, left, judging)
    progress("locating the misfit")
    judged = one_step(problem, baseline, accepted)
    place = localise_fits(problem, judged, np.random.default_rng([seed, 3]))
    progress("choosing the next experiment")
    proposal = propose(attribution, verdict, shown)
    misfit = misfit_of(problem, judged)
    return Diagnosis(
        dataset, final, floors, agreed, problem, attribution, left, shown, verdict, place, misfit,
        gain, residual, proposal, seed, quick, time.perf_counter() - begin,
    )  # fmt: skip


def _compared(dataset: Dataset, seed: int) -> tuple[tuple[Floor, ...], Consistency]:
    """How much each channel scatters, and whether the channels agree with each other."""
    floors = noise_floors(dataset)
    return floors, check_consistency(dataset, np.random.default_rng([seed, 2]), floors)


def _described(
    attribution: Attribution, left: Adequacy, judging: Problem | None
) -> ResidualModel | None:
    """What is left, as a sum of simple wrenches."""
    accepted = attribution.extrapolated().accepted.fit
    # Numbers that nobody believes would bend what is left.
    basis = attribution.baseline.fit if implausible(accepted) else accepted
    return residual_model(basis, left.threshold, judging)


def _judged_elsewhere(
    attribution: Attribution, left: Adequacy, judging: Problem | None, progress: Progress
) -> tuple[Adequacy, ResidualModel | None]:
    """What is left once the runs kept for judging were asked about it, and a model of it.

    Beside causes it stays as it is: it may be all that tells an imitation from what acts.
    """
    if attribution.accepted.causes:
        return left, None
    progress("asking the final runs about what is left")
    model = _described(attribution, left, judging)
    if model is not None and model.judged is not None:
        left = left.judged(model.judged.gain)
    return left, model


def _with_weaker_causes(
    attribution: Attribution,
    left: Adequacy,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[Attribution, Adequacy]:
    """One more search where something is known to be missing; kept if nothing then is."""
    more = extended(attribution, causes, rng, FULL, progress, LENIENCE)
    if more.accepted.causes == attribution.accepted.causes:
        return attribution, left
    progress("testing what is left")
    after = adequacy(more.accepted.fit, rng, more.tolerated)
    return (more, after) if after.reached else (attribution, left)


def _refitted(problem: Problem) -> Fit:
    """The refitted baseline; at rest unless a misfit drives it, which then is what comes next."""
    try:
        own = fit(problem, rounds=2, iterations=3)
        return own if strains(own) else finished(own)
    except np.linalg.LinAlgError:
        raise divergence(problem) from None


def fitted_and_final(dataset: Dataset, seed: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Runs to fit, and a quarter kept for judging where there are at least four.

    Repeats of a condition stay together: a run whose twin was fitted judges nothing.
    """
    conditions = {run.condition or run.id for run in dataset.runs}
    if len(conditions) < 4:
        return dataset.ids, ()
    split = split_runs(dataset, seed, (0.75, 0.0, 0.25), by="condition")
    return (*split.fit, *split.select), split.final
