"""Entries of ``diagnosis.json`` that runs and tables of steady motion share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any, Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.next_experiment import Proposal
from fish_env.diagnosis.residual_model import ResidualModel, Term
from fish_env.identification.generic_forces import wrench_unit
from fish_env.identification.noise_model import NoiseModel
from fish_env.inference.budget import Budget
from fish_env.inference.hypotheses import (
    CauseId,
    Coefficient,
    EffectParameterId,
    ParameterId,
    name_of,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.preconditions import Precondition
from fish_env.inference.vehicle import Coefficients, Effect
from fish_env.inference.verdict import Verdict

FORMAT = "robofish-diagnosis/1"
Plain = dict[str, Any]


class Identifiable(Protocol):
    """What is read of a problem."""

    @property
    def known(self) -> Mapping[str, Effect]:
        """Effects by name."""

    @property
    def baseline(self) -> Coefficients:
        """Baseline coefficients."""


class Identified(Protocol):
    """What is read of a fit, whatever it was fitted to."""

    @property
    def problem(self) -> Identifiable:
        """What was fitted."""

    @property
    def ids(self) -> tuple[ParameterId, ...]:
        """Free parameters, (n,), coefficients first."""

    @property
    def estimates(self) -> FloatArray:
        """(n,) in physical units."""

    def interval(self, parameter: ParameterId, /) -> tuple[float, float]:
        """95 % interval of one of them."""


def cause_entry(fit: Identified, cause: CauseId) -> Plain:
    """A cause with its parameters: estimate, interval, unit."""
    if isinstance(cause, Coefficient):
        entries = {"value": _estimate(fit, cause, fit.problem.baseline.unit(cause))}
    else:
        parameters = fit.problem.known[cause].parameters
        entries = {
            p.name: _estimate(fit, EffectParameterId(cause, p.name), p.unit) for p in parameters
        }
    return {"name": name_of(cause), "parameters": entries}


def _estimate(fit: Identified, parameter: ParameterId, unit: str) -> Plain:
    value = float(fit.estimates[fit.ids.index(parameter)])
    return {"estimate": value, "ci95": list(fit.interval(parameter)), "unit": unit}


def coefficient_entries(fit: Identified, detectable: Mapping[Coefficient, float]) -> list[Plain]:
    """Every baseline coefficient: nominal, estimated, and how surprising under its prior.

    Args:
        fit: estimates.
        detectable: coefficient -> how far off it would be found, in prior standard deviations; one
            that is missing cannot be found.
    """
    baseline = fit.problem.baseline
    return [
        {
            "name": name_of(one),
            "nominal": float(baseline.mean[i]),
            "estimate": float(fit.estimates[i]),
            "ci95": list(fit.interval(one)),
            "prior_sd": float(baseline.sd[i]),
            "prior_sds_off": float((fit.estimates[i] - baseline.mean[i]) / baseline.sd[i]),
            "smallest_detectable": _in_units(detectable.get(one), float(baseline.sd[i])),
            "unit": baseline.unit(one),
        }
        for i, one in enumerate(baseline.ids)
    ]


def _in_units(size: float | None, unit: float) -> float | None:
    return None if size is None else size * unit


def misfit_entry(misfit: Mapping[str, Pair]) -> Plain:
    """Errors of each channel, baseline and extended, in units of the noise."""
    return {name: {**asdict(pair), "unit": "noise sd"} for name, pair in misfit.items()}


def gain_entry(gain: Gain | None, units: Mapping[str, str] | None = None) -> Plain | None:
    """What an extension gained, if there is one.

    Args:
        gain: the gain.
        units: of each channel's error, to be named beside it.
    """
    if gain is None:
        return None
    share = None
    if gain.share is not None:
        share = {"estimate": gain.share, "ci95": _ends(gain.share_ci95)}
    named = {name: {"unit": unit} for name, unit in (units or {}).items()}
    return {
        "final_runs": list(gain.runs),
        "fit_percent": asdict(gain.fit_percent),
        "rmse": {name: {**asdict(pair), **named.get(name, {})} for name, pair in gain.rmse.items()},
        "misfit": misfit_entry(gain.misfit),
        "share_of_reachable": share,
    }


def _ends(interval: tuple[float, float] | None) -> list[float] | None:
    return None if interval is None else list(interval)


def budget_entry(budget: Budget | None) -> Plain | None:
    """The error budget: shares of the nominal simulation's misfit."""
    if budget is None:
        return None
    shares = [
        {
            "name": share.name,
            "share": share.share,
            "ci95": _ends(share.ci95),
            "alone": share.alone,
            "last": share.last,
            "channels": share.channels,
        }
        for share in budget.shares
    ]
    return {
        "runs": list(budget.runs),
        "held_out": budget.held_out,
        "misfit": budget.misfit,
        "shares": shares,
        "left": budget.left,
        "left_ci95": _ends(budget.left_ci95),
    }


def residual_entry(model: ResidualModel | None) -> Plain | None:
    """An empirical model of the residual: wrench = coefficient * function / function_rms."""
    if model is None:
        return None
    judged = model.judged
    gain = judged and {
        "final_runs": list(judged.runs),
        "log_likelihood": {"estimate": judged.gain, "ci95": list(judged.gain_ci95)},
    }
    without, beside = (disturbance_entry(noise) for noise in model.noise)
    return {
        "terms": [_term(term) for term in model.terms],
        "beside": list(model.beside),
        "disturbance": {"without": without, "with": beside},
        "gain": gain,
    }


def _term(term: Term) -> Plain:
    half = POLICY.interval_reach * term.error
    return {
        "direction": term.direction,
        "depends_on": term.function,
        "coefficient": term.coefficient,
        "ci95": [term.coefficient - half, term.coefficient + half],
        "unit": wrench_unit(term.direction),
        "function_rms": term.scale,
    }


def disturbance_entry(noise: NoiseModel) -> Plain:
    """The disturbance that a fit needs."""
    return {
        "force_sd": noise.force_sd,
        "moment_sd": noise.moment_sd,
        "correlation_s": noise.correlation_s,
        "phase_sd": noise.phase_sd,
        "jitter_sd": noise.jitter_sd,
    }


def precondition_entry(p: Precondition) -> Plain:
    """What the data could show of one effect."""
    sizes = {name: value for name, value in p.smallest_detectable.items() if isfinite(value)}
    return {
        "name": p.name,
        "absorbed_share": float(np.clip(p.absorbed_share, 0.0, 1.0)),
        "smallest_detectable": sizes,
        "most_confusable": list(p.most_confusable) if p.most_confusable else None,
        "excited": bool(p.excited),
    }


def experiment_entry(proposal: Proposal | None) -> Plain:
    """The manoeuvre to record next, if there is one."""
    if proposal is None:
        return {"schedule": [], "separates": []}
    return {
        "manoeuvre": proposal.name,
        "schedule": [dict(row) for row in proposal.schedule],
        "separates": list(proposal.separates),
        "separation": proposal.separation,
    }


def minor_notes(verdict: Verdict) -> list[str]:
    """Causes that the extended model holds and the verdict does not name."""
    little = f"less than {POLICY.least_named_share:.1%} of the misfit, in every channel"
    small = f"beside the other causes it makes up {little}, as errors of their models may"
    reasons = {
        **dict.fromkeys(verdict.minor, small),
        **dict.fromkeys(verdict.faint, "it may not act, if everything else is wrong a little"),
    }
    return [
        f"{name_of(cause)} is in the extended model but not named: {reason}."
        for cause, reason in reasons.items()
    ]
