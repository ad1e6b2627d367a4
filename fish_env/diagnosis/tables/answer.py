"""A diagnosis of a table as plain data, in the form ``robofish-diagnosis/1``."""

from __future__ import annotations

import numpy as np

from fish_env.diagnosis.answer import shared_entries
from fish_env.diagnosis.entries import Plain, gain_entry, minor_notes
from fish_env.diagnosis.result import TableDiagnosis
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import UNITS
from fish_env.inference.effort import TABLE_LEFT_OUT
from fish_env.inference.estimate.fit import Fit


def as_dict(diagnosis: TableDiagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds of a table."""
    shared = shared_entries(diagnosis)
    if shared["unexplained"]:
        asked = zip(shared["unexplained"], diagnosis.adequacy.misfits, strict=True)
        # Each alone is an empirical model of the residual: the coefficient times the function,
        # whose root mean square over the conditions is one.
        shared["unexplained"] = [{**entry, "coefficient": m.amount} for entry, m in asked]
    return {
        **shared,
        "kind": "steady",
        "fish": diagnosis.problem.fish.name,
        "left_out": list(TABLE_LEFT_OUT) if diagnosis.quick else [],
        "noise": _noise(diagnosis),
        "gain": gain_entry(diagnosis.gain, UNITS),
        "floor": _floor(diagnosis),
        "notes": [*diagnosis.notes, *minor_notes(diagnosis.verdict)],
    }


def _noise(diagnosis: TableDiagnosis) -> Plain:
    """Sensor noise by observation, and strengths of random pushes (their spectral density)."""
    scatter = diagnosis.accepted.noise
    names = diagnosis.problem.table.observations
    return {
        "sensor_sd": dict(zip(names, scatter.sensor_sd.tolist(), strict=True)),
        "disturbance": {"force_n2_s": scatter.force, "moment_n2_m2_s": scatter.moment},
        "assumed": scatter.assumed,
    }


def _floor(diagnosis: TableDiagnosis) -> Plain:
    """What is left against what repeats differ by; the ratio is None with too few repeats."""
    lack = diagnosis.adequacy.lack
    worst = [
        {"condition": c, "observation": o, "noise_sds": s}
        for c, o, s in worst_of(diagnosis.problem, diagnosis.accepted)
    ]
    return {
        "ratio": None if lack is None else lack.ratio,
        "p_value": None if lack is None else lack.p_value,
        "worst": worst,
    }


def worst_of(problem: TableProblem, fit: Fit) -> tuple[tuple[str, str, float], ...]:
    """Largest errors of averages over repeats: condition, observation, noise deviations."""
    table = problem.table
    _, column, condition = table.lines
    total = np.zeros(table.counts.shape)
    np.add.at(total, (condition, column), fit.linearised.residuals)
    sizes = total / np.sqrt(np.maximum(table.counts, 1.0))
    order = np.argsort(-np.abs(sizes), axis=None)[:5]
    return tuple(
        (table.conditions[i], table.observations[k], float(sizes[i, k]))
        for i, k in zip(*np.unravel_index(order, sizes.shape), strict=True)
    )
