"""Answers and series for the tests of the report, without a diagnosis behind them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from fish_env.diagnosis.manoeuvres import MENU
from fish_env.diagnosis.regimes import RunResiduals, localise
from fish_env.diagnosis.report import ReportSeries, RunSeries, SteadySeries
from fish_env.params import load_fish
from fish_env.replay import motion_from_trajectory
from fish_env.simulator import Simulator

FISH = "zheng-2021-a"
CHANNELS = ("x", "y", "yaw", "r")
CAUSE = {
    "name": "servo_lag",
    "parameters": {"time_constant": {"estimate": 0.054, "ci95": [0.05, 0.058], "unit": "s"}},
}
RIVAL = {
    "name": "wake_memory",
    "parameters": {"time_constant": {"estimate": 0.1, "ci95": [0.08, 0.12], "unit": "s"}},
}

_PUSH = {"force_sd": 0.004, "moment_sd": 1e-4, "correlation_s": 0.5, "phase_sd": 0.0}
RESIDUAL = {
    "terms": [{
        "direction": "heave", "depends_on": "w|w|", "coefficient": -0.012, "ci95": [-0.013, -0.011],
        "unit": "N", "function_rms": 0.02,
    }],
    "beside": ["current"],
    "disturbance": {"without": {**_PUSH, "force_sd": 0.007}, "with": _PUSH},
    "gain": {"final_runs": ["r01"], "log_likelihood": {"estimate": 40.0, "ci95": [20.0, 60.0]}},
}  # fmt: skip


def answer(verdict: str = "cause", **changes: Any) -> dict[str, Any]:
    """Content of a diagnosis.json with every part in it."""
    pair = {"baseline": 5.0, "extended": 1.0}
    named = verdict in ("cause", "parameters", "ambiguous")
    full = {
        "format": "robofish-diagnosis/1", "dataset": "pool <b>", "fish": FISH, "seed": 0,
        "quick": False, "runtime_s": 12.0, "verdict": verdict,
        "verdict_once_corrected": "no_misfit",
        "causes": [CAUSE] if named else [],
        "alternatives": [[RIVAL]] if verdict == "ambiguous" else [],
        "parameters": [{
            "name": "parameter:mass.total", "nominal": 2.0, "estimate": 1.99, "ci95": [1.9, 2.1],
            "prior_sd": 0.02, "prior_sds_off": -0.5, "unit": "kg",
        }],
        "noise": {
            "sensor_sd": {"x": 0.002},
            "disturbance": {"force_sd": 0.002, "moment_sd": 1e-4, "correlation_s": 0.5},
        },
        "noise_floor": [{
            "channel": "yaw", "white": {"sd": 0.002, "ci95": [0.0019, 0.0021]},
            "upper_bound": False, "filter_sd": 0.00217,
        }],
        "consistency": {"sentences": ["roll, p agree with each other."]},
        "budget": {
            "runs": ["r01"], "held_out": True, "misfit": 60.0, "left": 0.05, "left_ci95": None,
            "shares": [
                {"name": "servo_lag", "share": 0.8, "ci95": None},
                {"name": "coefficients", "share": 0.17, "ci95": None},
                {"name": "run_variation", "share": -0.02, "ci95": None},
            ],
        } if named else None,
        "fitted_runs": 5,
        "misfit": {name: {**pair, "unit": "noise sd"} for name in CHANNELS},
        "gain": {
            "final_runs": ["r01"], "fit_percent": {"baseline": 40.0, "extended": 90.0},
            "rmse": {name: {"baseline": 0.2, "extended": 0.02} for name in CHANNELS},
            "misfit": {}, "share_of_reachable": {"estimate": 0.96, "ci95": [0.9, 1.0]},
        } if named else None,
        "preconditions": [
            {"name": "current", "absorbed_share": 0.2, "smallest_detectable": {"north": 0.004},
             "most_confusable": ["tether", 0.61], "excited": True},
            {"name": "surface_drag", "absorbed_share": 1.0, "smallest_detectable": {},
             "most_confusable": None, "excited": False},
        ],
        "ranking": [
            {"name": "servo_lag", "score": 450.0, "ci95": [400.0, 500.0]},
            {"name": "wake_memory", "score": 250.0},
        ],
        "unexplained": [
            {"depends_on": "depth", "direction": "surge", "rms": 0.01, "log_p": -30.0}
        ] if verdict == "outside_library" else [],
        "residual_model": RESIDUAL if verdict == "outside_library" else None,
        "next_experiment": {
            "manoeuvre": MENU[0].name, "schedule": [dict(row) for row in MENU[0].schedule],
            "separates": ["wake_memory"], "separation": 30.0,
        },
        "notes": ["one note"],
    }  # fmt: skip
    return full | changes


@cache
def run_series() -> ReportSeries:
    """Two runs of a real swim; the baseline is off, the extended model is nearly right."""
    fish, runs = load_fish(FISH), []
    swim = Simulator(fish).run(
        [{"t": 0.0, "tail_amplitude": 0.5, "tail_frequency": 1.5}], 6.0, rate_hz=25.0
    )
    for id, final in (("r01", True), ("r02", False)):
        measured = {name: swim.channels[name] for name in CHANNELS}
        motions = tuple(
            motion_from_trajectory(swim, role, role)  # type: ignore[arg-type]
            for role in ("measured", "baseline", "extended")
        )
        runs.append(
            RunSeries(
                id, final, swim.time_s, measured,
                {name: 0.8 * values for name, values in measured.items()},
                {name: 0.99 * values for name, values in measured.items()},
                motions, {"baseline": 40.0, "extended": 90.0}, ("a note about this run",),
            )
        )  # fmt: skip
    return ReportSeries(fish, tuple(runs), _localisation())


def _localisation() -> Any:
    rng, runs = np.random.default_rng(0), []
    for i in range(4):
        time = 0.04 * np.arange(300)
        phase = (3.0 * np.pi * time + i) % (2 * np.pi)
        regimes = {
            "speed": 0.1 + 0.05 * np.sin(time), "pitch": 0.1 * np.sin(time + i),
            "depth": 0.5 + 0.1 * time, "tail_phase": phase,
            "tail_amplitude": np.full(300, 0.4), "tail_frequency": np.full(300, 1.5),
            "time": time,
        }  # fmt: skip
        residuals = rng.normal(size=(300, len(CHANNELS)))
        residuals[phase < 0.7, 3] *= 3.0
        runs.append(RunResiduals(residuals, regimes))
    return localise(CHANNELS, runs, rng, 99)


def steady_series() -> SteadySeries:
    """A table of six conditions, two of them kept for judging."""
    measured = {
        "surge_speed": np.array([0.02, 0.03, np.nan, 0.05, 0.06, 0.07]),
        "yaw_rate": np.array([0.0, 0.1, 0.2, -0.1, -0.2, 0.3]),
    }
    return SteadySeries(
        tuple("abcdef"), np.zeros((6, 5)), measured,
        {name: 1.3 * values for name, values in measured.items()},
        {name: 1.02 * values for name, values in measured.items()},
        np.array([False, False, False, False, True, True]),
    )  # fmt: skip
