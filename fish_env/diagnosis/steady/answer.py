"""A diagnosis of a table as plain data, in the form ``robofish-diagnosis/1``."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from fish_env.diagnosis.entries import cause_entry, coefficient_entries
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.next_experiment import Proposal
from fish_env.diagnosis.preconditions import Precondition
from fish_env.diagnosis.steady.attribution import Explanation
from fish_env.diagnosis.steady.fitting import SteadyFit
from fish_env.diagnosis.steady.table import UNITS

if TYPE_CHECKING:
    from fish_env.diagnosis.steady.pipeline import SteadyDiagnosis

FORMAT = "robofish-diagnosis/1"
Plain = dict[str, Any]


def as_dict(diagnosis: SteadyDiagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds."""
    verdict, accepted = diagnosis.verdict, diagnosis.accepted
    rivals = [r for r in diagnosis.attribution.rivals if r.causes in verdict.alternatives]
    return {
        "format": FORMAT,
        "kind": "steady",
        "dataset": diagnosis.dataset.name,
        "fish": accepted.problem.fish.name,
        "seed": diagnosis.seed,
        "quick": diagnosis.quick,
        "runtime_s": diagnosis.runtime_s,
        "verdict": verdict.name,
        "causes": [cause_entry(accepted, name) for name in verdict.causes],
        "alternatives": [_explanation(rival) for rival in rivals],
        "parameters": coefficient_entries(accepted),
        "noise": _noise(accepted),
        "misfit": {name: _pair(pair) for name, pair in diagnosis.misfit.items()},
        "gain": _gain(diagnosis.gain),
        "preconditions": [_precondition(p) for p in diagnosis.shown],
        "ranking": [{"name": n, "score": s} for n, s in diagnosis.attribution.ranking],
        "floor": _floor(diagnosis),
        "unexplained": [] if diagnosis.adequacy.reached else _unexplained(diagnosis),
        "next_experiment": _experiment(diagnosis.next_experiment),
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


def _pair(pair: Pair) -> Plain:
    return {**asdict(pair), "unit": "noise sd"}


def _gain(gain: Gain | None) -> Plain | None:
    if gain is None:
        return None
    share = None
    if gain.share is not None and gain.share_ci95 is not None:
        share = {"estimate": gain.share, "ci95": list(gain.share_ci95)}
    return {
        "final_runs": list(gain.runs),
        "fit_percent": asdict(gain.fit_percent),
        "rmse": {name: {**asdict(pair), "unit": UNITS[name]} for name, pair in gain.rmse.items()},
        "misfit": {name: _pair(pair) for name, pair in gain.misfit.items()},
        "share_of_reachable": share,
    }


def _precondition(p: Precondition) -> Plain:
    sizes = {name: value for name, value in p.smallest_detectable.items() if isfinite(value)}
    return {
        "name": p.name,
        "absorbed_share": float(np.clip(p.absorbed_share, 0.0, 1.0)),
        "smallest_detectable": sizes,
        "most_confusable": list(p.most_confusable) if p.most_confusable else None,
        "excited": bool(p.excited),
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


def _experiment(proposal: Proposal | None) -> Plain:
    if proposal is None:
        return {"schedule": [], "separates": []}
    return {
        "manoeuvre": proposal.name,
        "schedule": [dict(row) for row in proposal.schedule],
        "separates": list(proposal.separates),
        "separation": proposal.separation,
    }
