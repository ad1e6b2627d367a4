"""A diagnosis of a table as plain data, in the form ``robofish-diagnosis/1``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fish_env.diagnosis.causes import coefficient_sizes
from fish_env.diagnosis.effort import STEADY_LEFT_OUT
from fish_env.diagnosis.entries import (
    FORMAT,
    Plain,
    cause_entry,
    coefficient_entries,
    experiment_entry,
    gain_entry,
    misfit_entry,
    precondition_entry,
)
from fish_env.diagnosis.steady.attribution import Explanation
from fish_env.diagnosis.steady.fitting import SteadyFit
from fish_env.diagnosis.steady.screening import smallest_detectable
from fish_env.diagnosis.steady.table import UNITS

if TYPE_CHECKING:
    from fish_env.diagnosis.steady.pipeline import SteadyDiagnosis


def as_dict(diagnosis: SteadyDiagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds."""
    verdict, accepted = diagnosis.verdict, diagnosis.accepted
    rivals = [r for r in diagnosis.attribution.rivals if r.causes in verdict.alternatives]
    screen = diagnosis.attribution.screens[0]
    sizes = coefficient_sizes(screen.signals, lambda s: smallest_detectable(s, 0, screen.threshold))
    return {
        "format": FORMAT,
        "kind": "steady",
        "dataset": diagnosis.dataset.name,
        "fish": accepted.problem.fish.name,
        "seed": diagnosis.seed,
        "quick": diagnosis.quick,
        "left_out": list(STEADY_LEFT_OUT) if diagnosis.quick else [],
        "runtime_s": diagnosis.runtime_s,
        "verdict": verdict.name,
        "causes": [cause_entry(accepted, name) for name in verdict.causes],
        "alternatives": [_explanation(rival) for rival in rivals],
        "parameters": coefficient_entries(accepted, sizes),
        "noise": _noise(accepted),
        "misfit": misfit_entry(diagnosis.misfit),
        "gain": gain_entry(diagnosis.gain, UNITS),
        "preconditions": [precondition_entry(p) for p in diagnosis.shown],
        "ranking": [{"name": n, "score": s} for n, s in diagnosis.attribution.ranking],
        "floor": _floor(diagnosis),
        "unexplained": [] if diagnosis.adequacy.reached else _unexplained(diagnosis),
        "next_experiment": experiment_entry(diagnosis.next_experiment),
        "notes": list(diagnosis.notes),
    }


def _explanation(explanation: Explanation) -> list[Plain]:
    return [cause_entry(explanation.fit, name) for name in explanation.causes]


def _noise(fit: SteadyFit) -> Plain:
    """Sensor noise by observation, and strengths of random pushes (their spectral density)."""
    names, scatter = fit.problem.table.observations, fit.scatter
    return {
        "sensor_sd": dict(zip(names, scatter.sensor_sd.tolist(), strict=True)),
        "disturbance": {"force_n2_s": scatter.force, "moment_n2_m2_s": scatter.moment},
        "assumed": scatter.assumed,
    }


def _floor(diagnosis: SteadyDiagnosis) -> Plain:
    """What is left against what repeats differ by; the ratio is None with too few repeats."""
    known = diagnosis.adequacy
    worst = [{"condition": c, "observation": o, "noise_sds": s} for c, o, s in known.worst]
    return {"ratio": known.ratio, "p_value": known.p_value, "worst": worst}


def _unexplained(diagnosis: SteadyDiagnosis) -> list[Plain]:
    """Forces and moments that the averages still ask for, as functions of the commands.

    Each alone is an empirical model of the residual: the coefficient times the function, whose
    root mean square over the conditions is one.
    """
    return [
        {
            "depends_on": m.function,
            "direction": m.direction,
            "rms": m.size,
            "coefficient": m.coefficient,
            "log_p": m.log_p,
        }
        for m in diagnosis.adequacy.misfits
    ]
