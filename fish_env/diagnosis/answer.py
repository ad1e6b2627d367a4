"""A diagnosis as plain data, in the form ``robofish-diagnosis/1`` of ``diagnosis.json``."""

from __future__ import annotations

from statistics import pstdev

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset
from fish_env.diagnosis.entries import (
    FORMAT,
    Plain,
    budget_entry,
    cause_entry,
    coefficient_entries,
    disturbance_entry,
    experiment_entry,
    gain_entry,
    minor_notes,
    misfit_entry,
    precondition_entry,
    residual_entry,
)
from fish_env.diagnosis.input_checks import doubts
from fish_env.diagnosis.policy import policies_as_dict
from fish_env.diagnosis.regimes import as_plain
from fish_env.diagnosis.result import Diagnosed, Diagnosis
from fish_env.identification.beats import beats_of, by_run, uneven
from fish_env.identification.generic_forces import wrench_unit
from fish_env.identification.series import series_of
from fish_env.identification.variation import USUAL_BEAT, USUAL_SAG
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import least_of, spread_of
from fish_env.inference.estimate.run_variation import shown_spread
from fish_env.inference.hypotheses import name_of
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import coefficient_sizes
from fish_env.inference.ranking import Ranked
from fish_env.inference.screening import smallest_detectable
from fish_env.rigidbody import consistency, noise_floor, outliers
from fish_env.version import VERSION


def as_dict(diagnosis: Diagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds of runs over time."""
    binds = diagnosis.inputs.binding
    answer = {
        **shared_entries(diagnosis),
        "verdict": "inputs" if binds else diagnosis.verdict.name,
        "inputs": diagnosis.inputs.as_list(),
        "verdict_once_corrected": diagnosis.verdict.name,
        "fish": diagnosis.problem.fish.name,
        "left_out": list(diagnosis.left_out),
        "noise": _noise(diagnosis.accepted),
        "noise_floor": _floors(diagnosis),
        "outliers": outliers.as_dict(diagnosis.outliers),
        "consistency": consistency.as_dict(diagnosis.consistency),
        "beats": _beats(diagnosis.inputs.logged),
        "gain": gain_entry(diagnosis.gain),
        "localisation": as_plain(diagnosis.localisation),
        "residual_model": residual_entry(diagnosis.residual),
        "notes": [
            *diagnosis.dataset.notes,
            *_chance(diagnosis),
            *minor_notes(diagnosis.verdict),
            *_cut_short(diagnosis),
        ],
    }
    if diagnosis.inputs.silent:  # what a fit to noise needs says nothing of the fish
        return {**answer, "budget": None, "unexplained": [], "implausible": [], "doubts": []}
    return {**answer, "doubts": doubts(answer)}


def shared_entries(diagnosis: Diagnosed) -> Plain:
    """What ``diagnosis.json`` holds of every diagnosis."""
    verdict, attribution = diagnosis.verdict, diagnosis.attribution
    alternatives = {  # of explanations that are named alike, the best comes last and stays
        named: [cause_entry(rival.fit, cause) for cause in named]
        for rival in reversed((attribution.accepted, *attribution.rivals))
        if (named := verdict.named(rival.causes)) in verdict.alternatives
    }
    screen = attribution.first
    sizes = coefficient_sizes(screen.signals, lambda s: smallest_detectable(s, 0, screen.threshold))
    return {
        "format": FORMAT,
        "version": VERSION,
        "dataset": diagnosis.dataset.name,
        "seed": diagnosis.seed,
        "quick": diagnosis.quick,
        "policy": policies_as_dict(),
        "runtime_s": diagnosis.runtime_s,
        "verdict": verdict.name,
        "causes": [cause_entry(diagnosis.accepted, cause) for cause in verdict.causes],
        "alternatives": [alternatives[named] for named in verdict.alternatives],
        "parameters": coefficient_entries(diagnosis.accepted, sizes),
        "run_variation": run_variation_entry(diagnosis.accepted),
        "budget": budget_entry(diagnosis.budget),
        "misfit": misfit_entry(diagnosis.misfit),
        "fitted_runs": diagnosis.accepted.problem.run_count,
        "preconditions": [precondition_entry(p) for p in diagnosis.preconditions],
        "ranking": [_rank(ranked) for ranked in attribution.ranking],
        "unexplained": [] if diagnosis.adequacy.reached else _unexplained(diagnosis),
        "next_experiment": experiment_entry(diagnosis.next_experiment),
        "implausible": list(diagnosis.adequacy.implausible),
    }


def _beats(dataset: Dataset) -> Plain:
    """Measured over commanded tail frequency of each run that shows it."""
    beats = beats_of(dataset)
    runs = {run: {"ratio": ratio, "sd": sd} for run, (ratio, sd) in by_run(beats).items()}
    return {"uneven": uneven(beats), "runs": runs}


def _rank(ranked: Ranked) -> Plain:
    return {"name": name_of(ranked.cause), "score": ranked.score, "ci95": list(ranked.interval)}


def _noise(fit: Fit) -> Plain:
    sensors = zip(series_of(fit).channels, fit.noise.sensor_sd.tolist(), strict=True)
    return {
        "sensor_sd": dict(sensors),
        "disturbance": disturbance_entry(fit.noise),
    }


def _floors(diagnosis: Diagnosis) -> list[Plain]:
    """Noise of each channel from the data alone, beside what the filter of the answer uses."""
    used = _noise(diagnosis.accepted)["sensor_sd"]
    floors = map(noise_floor.as_dict, diagnosis.floors)
    return [{**floor, "filter_sd": used.get(floor["channel"])} for floor in floors]


def run_variation_entry(fit: Fit) -> list[Plain]:
    """What the runs differ in, and errors of sensors: spread beside the usual one, and values."""
    problem, (predicted, spread), entries = fit.problem, _predicted(fit), []
    for i, known in enumerate(problem.variations):
        sd = float(spread[i])
        if sd > 0.0:
            entries.append(
                {"name": known.name, "unit": known.unit, "sd": sd, "usual_sd": known.usual,
                 "shared": known.shared, "values": predicted[:, i].tolist(),
                 "beyond_usual": sd > POLICY.beyond_usual * known.usual}
            )  # fmt: skip
    return [*_own_beats(fit), *entries]


def _predicted(fit: Fit) -> tuple[FloatArray, FloatArray]:
    """(R, K) best prediction of what each run differs in, those integrated out too, and spreads.

    Runs whose drive is uneven are fitted with the usual spreads; told are those that data show.
    """
    values, marginal = fit.problem.variation.copy(), fit.linearised.marginal
    spread = spread_of(fit.problem, fit.noise).copy()
    if marginal is not None:
        active = np.flatnonzero(spread)
        residuals = np.concatenate([run.residuals for run in fit.filtered])
        numbers = marginal.predicted(residuals, least=least_of(fit.problem, active))
        values[:, active] = numbers * spread[active]
        if fit.problem.drive.uneven:
            spread[active] *= shown_spread(numbers, marginal.uncertainty())
    return values, spread


def _own_beats(fit: Fit) -> list[Plain]:
    """Spread over runs of the tail's frequency and of its sag, where they differ in it."""
    runs = getattr(fit.problem, "runs", ())
    beats, sags = [run.own_beat for run in runs], [run.own_sag for run in runs]
    entries: list[Plain] = []
    for name, unit, usual, values, none in (
        ("own_beat", "1", USUAL_BEAT, beats, 1.0),
        ("own_sag", "1/s", USUAL_SAG, sags, 0.0),
    ):
        if any(value != none for value in values):
            sd = pstdev(values)
            entries.append(
                {"name": name, "unit": unit, "sd": sd, "usual_sd": usual, "shared": False,
                 "beyond_usual": sd > POLICY.beyond_usual * usual, "values": values}
            )  # fmt: skip
    return entries


def _unexplained(diagnosis: Diagnosed) -> list[Plain]:
    """Generic forces that the data still indicate beside the best explanation."""
    return [
        {
            "depends_on": m.function,
            "direction": m.direction,
            "rms": float(m.size),
            "log_p": m.log_p,
            "changing": m.changing,
        }
        for m in diagnosis.adequacy.misfits
    ]


def _chance(diagnosis: Diagnosis) -> list[str]:
    """The force that the fitted runs indicate and that other runs do not confirm."""
    gain = diagnosis.adequacy.refuted
    if gain is None:
        return []
    asked = _unexplained(diagnosis)[0]
    return [
        f"The fitted runs indicate {_wrench(asked)} ({asked['rms']:.2g} "
        f"{wrench_unit(asked['direction'])}), little more than chance would. It does not improve "
        f"the prediction of other runs (log likelihood {gain:+.2g}), so it counts as chance."
    ]


def _cut_short(diagnosis: Diagnosis) -> list[str]:
    """That the search did not come to an end of its own."""
    if not diagnosis.cut_short:
        return []
    return [
        "No further search for causes began after all runs had been simulated "
        f"{POLICY.most_passes:,.0f} times. More causes may act. Diagnose again with --patient to "
        "search without this limit."
    ]


def _wrench(term: Plain) -> str:
    """One wrench in words."""
    kind = "force" if wrench_unit(term["direction"]) == "N" else "moment"
    return f"a {kind} in {term['direction']} that depends on {term['depends_on']}"


def dependence(item: Plain) -> str:
    """What a generic force that is indicated depends on, and whether its size stays."""
    changing = ", with a size or sign that changes every few seconds"
    return str(item["depends_on"]) + (changing if item.get("changing") else "")


def holds_elsewhere(answer: Plain) -> bool:
    """Whether the model of the residual improves the prediction of held-out runs."""
    gain = (answer.get("residual_model") or {}).get("gain")
    return bool(gain and gain["log_likelihood"]["ci95"][0] > 0.0)
