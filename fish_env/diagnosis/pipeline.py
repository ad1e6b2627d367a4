"""``diagnose``: from a folder of measured runs to a verdict with numbers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fish_env.data import Dataset, SteadyDataset, dataset_files, load_dataset, split_runs
from fish_env.diagnosis.answer import as_dict
from fish_env.diagnosis.gain import measure_gain, misfit_of, one_step
from fish_env.diagnosis.input_checks import check_runs, divergence
from fish_env.diagnosis.inputs.check import check_inputs
from fish_env.diagnosis.next_experiment import propose
from fish_env.diagnosis.policy import CHECKS
from fish_env.diagnosis.regimes import localise_fits
from fish_env.diagnosis.report import ReportSeries, series_from, write_report
from fish_env.diagnosis.residual_model import ResidualModel, residual_model
from fish_env.diagnosis.result import Diagnosis
from fish_env.diagnosis.tables.pipeline import diagnose_steady
from fish_env.diagnosis.writing import check_own, outputs, write_answer
from fish_env.errors import DatasetError
from fish_env.files import check_outputs
from fish_env.heap import give_back_large_arrays
from fish_env.identification.beats import with_measured_beats
from fish_env.identification.copies import without_copies
from fish_env.identification.model_outliers import without_model_outliers
from fish_env.identification.own_beats import own_beats, with_own_beats
from fish_env.identification.recorded import recorded
from fish_env.identification.run_noise import with_noisy_runs_told
from fish_env.identification.sensors import with_noise_shown, without_outliers
from fish_env.identification.series import SeriesProblem, series_of
from fish_env.identification.tail_drive import tail_drive
from fish_env.identification.writing import identified_fish
from fish_env.inference.effort import QUICK, Effort, effort_of
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.parallel import both
from fish_env.inference.pipeline import investigate, refit_baseline, unnamed
from fish_env.inference.probes import causes_of
from fish_env.inference.progress import Report, silent
from fish_env.inference.verdict import EXTENDING
from fish_env.params.io import as_fish, fish_files
from fish_env.params.schema import FishParams
from fish_env.rigidbody.consistency import Consistency, check_consistency
from fish_env.rigidbody.noise_floor import Floor, noise_floors

USELESS = (
    "With all causes that were found the model predicts held-out runs no better than their mean. "
    "So nothing is named."
)


def diagnose(
    folder: str | Path | Dataset | SteadyDataset,
    out: str | Path | None = None,
    seed: int = 0,
    quick: bool = False,
    fish: FishParams | str | Path | None = None,
    progress: Report | None = None,
    measured_beats: bool = False,
    trust_effects: bool = False,
    patient: bool = False,
) -> dict[str, Any]:
    """Diagnose a folder of measured runs.

    Args:
        folder: folder with a dataset.yaml, the name of a shipped dataset, or a dataset.
        out: folder for ``diagnosis.json``, ``report.html`` with its figures and, where there is
            something to extend, ``extended.yaml``; nothing is written without it.
        seed: of the split and of the null distributions.
        quick: quick mode, which leaves out what :data:`~fish_env.inference.effort.QUICK` says.
        fish: another fish than the dataset names: parameters, preset or file.
        progress: told the name of each step.
        measured_beats: take the tail's frequencies from the hull's swaying, not from the commands.
        trust_effects: run the effect files that the fish's file names, see ``load_fish``.
        patient: search without a limit on how often the runs are simulated; quick mode and tables
            have none.

    Returns:
        The content of ``diagnosis.json``.

    Raises:
        DatasetError: the data cannot be read, or no diagnosis should be built on them.
        ParameterError: the fish cannot be used.
        OutputError: an output would replace a file that is read, or cannot be written.
    """
    tell = progress or silent
    dataset = folder if isinstance(folder, Dataset | SteadyDataset) else load_dataset(folder)
    chosen = as_fish(fish or dataset.fish, trust_effects)
    if out is not None:
        read = [] if isinstance(folder, Dataset | SteadyDataset) else dataset_files(folder)
        check_outputs(outputs(chosen, Path(out)), [*read, *fish_files(chosen)])
        check_own(chosen, Path(out))
    if not isinstance(dataset, Dataset):
        if measured_beats:
            raise DatasetError(f"{dataset.name}: means hold no beat; leave out --measured-beats")
        where = Path(out) if out is not None else None
        return diagnose_steady(dataset, chosen, seed=seed, quick=quick, progress=tell, out=where)
    if measured_beats:
        dataset = with_measured_beats(dataset, chosen)
    diagnosis = diagnose_runs(dataset, chosen, seed, quick, tell, patient)
    answer = as_dict(diagnosis)
    if out is not None:
        tell("writing the report")
        write(diagnosis, answer, Path(out))
    return answer


def write(diagnosis: Diagnosis, answer: dict[str, Any], folder: Path) -> None:
    """Writes ``diagnosis.json``, ``report.html`` and, if something extends, ``extended.yaml``."""
    extends = diagnosis.verdict.name in EXTENDING and not diagnosis.inputs.binding
    extended = identified_fish(diagnosis.accepted) if extends else None
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
    progress: Report = silent,
    patient: bool = False,
) -> Diagnosis:
    """Diagnose time series.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own.
        seed: of the split and of the null distributions.
        quick: quick mode, which leaves out what :data:`~fish_env.inference.effort.QUICK` says.
        progress: told the name of each step.
        patient: search without a limit on how often the runs are simulated; quick mode and tables
            have none.

    Raises:
        DatasetError: no diagnosis should be built on these runs.
    """
    give_back_large_arrays()
    # The filter has its own threads; those of the linear algebra would wait for each other.
    with threadpool_limits(1, "blas"):
        return _diagnose_runs(dataset, fish, seed, effort_of(quick, patient), progress)


def _diagnose_runs(
    dataset: Dataset, fish: FishParams | None, seed: int, effort: Effort, progress: Report
) -> Diagnosis:
    begin = time.perf_counter()
    progress("checking the runs")
    check_runs(dataset)
    dataset, outliers = without_outliers(without_copies(dataset))
    dataset = with_noisy_runs_told(with_noise_shown(dataset))
    progress("checking signs, units and clocks")
    inputs = check_inputs(dataset, fish, seed)
    dataset = inputs.dataset
    fitted, final = fitted_and_final(dataset, seed)
    progress("comparing the beats of the runs")
    every = SeriesProblem(dataset, fish, dt=effort.step_s, most_passes=effort.most_passes)
    every = every.with_drive(tail_drive(inputs.drive, inputs.drive_certain))
    if effort.retries and not inputs.silent:
        every, outliers = without_model_outliers(every, outliers)
        every = with_own_beats(every, own_beats(every, inputs.beats_corrected))
    chosen = _named(every, fitted)
    problem = chosen.some(chosen.spread(effort.runs)).until(effort.seconds)
    judging = _named(every, final) if final else None
    progress("comparing the channels with each other")
    progress("refitting the baseline")
    compare = partial(_compared, dataset, seed)
    baseline, (floors, agreed) = both(partial(_refitted, problem), compare)
    problem = series_of(baseline)  # with the tail phases settled
    # In runs of noise only there is nothing to name, and nothing to model.
    causes, describe = ([], None) if inputs.silent else (causes_of(problem), residual_model)
    found = investigate(
        baseline, causes, np.random.default_rng(seed), effort, progress, judging, describe
    )
    gain, baseline = None, found.attribution.baseline.fit
    if found.gap is not None and judging is not None:
        gain = measure_gain(judging, baseline, found.accepted, found.gap)
        if gain.is_useless:
            found, gain = unnamed(found, judging), None
            dataset = replace(dataset, notes=(*dataset.notes, USELESS))
    progress("locating the misfit")
    problem = problem.in_usual_steps()  # what was published, where comparisons do with less
    judged = one_step(baseline, found.accepted)
    place = localise_fits(problem, judged, np.random.default_rng([seed, 3]))
    progress("choosing the next experiment")
    proposal = propose(found.attribution, found.verdict, found.preconditions)
    residual = found.residual if isinstance(found.residual, ResidualModel) else None
    return Diagnosis(
        dataset=dataset, outliers=outliers, inputs=inputs, final_runs=final, floors=floors,
        consistency=agreed, problem=problem, attribution=found.attribution, adequacy=found.adequacy,
        preconditions=found.preconditions, verdict=found.verdict, localisation=place,
        misfit=misfit_of(problem, judged), gain=gain, residual=residual, next_experiment=proposal,
        budget=found.budget, seed=seed, quick=effort is QUICK,
        runtime_s=time.perf_counter() - begin,
    )  # fmt: skip


def _named(problem: SeriesProblem, ids: Sequence[str]) -> SeriesProblem:
    return problem.some([problem.run_ids.index(id) for id in ids])


def _compared(dataset: Dataset, seed: int) -> tuple[tuple[Floor, ...], Consistency]:
    """How much each channel scatters, and whether the channels agree with each other."""
    recording = recorded(dataset)
    floors = noise_floors(recording)
    return floors, check_consistency(recording, np.random.default_rng([seed, 2]), floors)


def _refitted(problem: SeriesProblem) -> Fit:
    """The refitted baseline, in the usual steps: in longer ones a lag of some ms diverges."""
    try:
        return refit_baseline(problem)
    except np.linalg.LinAlgError:
        raise divergence(problem) from None


def fitted_and_final(dataset: Dataset, seed: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Runs to fit, and a quarter kept for judging where there are at least four.

    Repeats of a condition stay together: a run whose twin was fitted judges nothing.
    """
    conditions = {run.condition or run.id for run in dataset.runs}
    if len(conditions) < CHECKS.fewest_for_held_out:
        return dataset.ids, ()
    share = CHECKS.held_out_runs
    split = split_runs(dataset, seed, (1.0 - share, 0.0, share), by="condition")
    return (*split.fit, *split.select), split.final
