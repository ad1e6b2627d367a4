"""Predictions of whole runs from their beginnings, and how far they are off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.channels import BY_NAME
from fish_env.identification.runs import RunData
from fish_env.identification.whole_runs.problem import WholeRunProblem
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.problem import Point

FIRST_S = 3.0
"""Beginning of a run by which its start is estimated (s); the rest is predicted."""
PLANAR = ("x", "y", "yaw")
MEANS = {"surge": "m/s", "sway": "m/s", "yaw_rate": "rad/s"}


@dataclass(frozen=True)
class Prediction:
    """Errors of the prediction of one run.

    Attributes:
        run: id.
        errors: quantity -> mean absolute error over the run for channels and ``path`` (the
            horizontal distance), error of the mean over the second half for ``surge``, ``sway``
            and ``yaw_rate``; SI.
        measured: the measured means over the second half, SI.
    """

    run: str
    errors: dict[str, float]
    measured: dict[str, float]


def whole_runs_of(fit: Fit) -> WholeRunProblem:
    """The problem of a fit to whole runs.

    Raises:
        TypeError: the fit is one to other data.
    """
    if not isinstance(fit.problem, WholeRunProblem):
        raise TypeError(f"expected a fit to whole runs, not to {type(fit.problem).__name__}")
    return fit.problem


def predict(problem: WholeRunProblem, fit: Fit) -> list[FloatArray]:
    """Simulated channels (T, C) of runs of which only the beginning is known.

    Args:
        problem: the runs, which need not be those of the fit.
        fit: whose parameters are used, its tail frequency among them.
    """
    held = problem.at_pace(1.0)
    early = held.until(FIRST_S)
    return simulated(held, fit.point, early.settled(fit.point, fit.noise).starts or ())


def simulated(
    problem: WholeRunProblem, point: Point, starts: Sequence[FloatArray]
) -> list[FloatArray]:
    """Simulated channels (T, C) of runs with given own numbers (K,), angles next to the measured.

    Samples that were not measured are NaN.
    """
    effects = {id: np.array([value]) for id, value in point.effects.items()}
    errors = problem.errors(point.z[:, None], effects, [own[:, None] for own in starts])
    pairs = zip(problem.runs, errors, strict=True)
    return [run.measured - each[0] for run, each in pairs]


def prediction_errors(problem: WholeRunProblem, fit: Fit) -> list[Prediction]:
    """Errors of the predictions of some runs from their beginnings.

    Args:
        problem: the runs.
        fit: whose parameters are used.
    """
    pairs = zip(problem.runs, predict(problem, fit), strict=True)
    return [_compared(run, problem.channels, values) for run, values in pairs]


def _compared(run: RunData, channels: tuple[str, ...], predicted: FloatArray) -> Prediction:
    away = predicted - run.measured
    errors = {name: float(np.nanmean(np.abs(away[:, i]))) for i, name in enumerate(channels)}
    measured: dict[str, float] = {}
    if set(PLANAR) <= set(channels):
        columns = [channels.index(name) for name in PLANAR]
        distance = np.hypot(away[:, columns[0]], away[:, columns[1]])
        errors["path"] = float(np.nanmean(distance))
        truth = second_half(run.clock, run.measured[:, columns])
        model = second_half(run.clock, predicted[:, columns])
        measured = dict(zip(MEANS, truth.tolist(), strict=True))
        errors |= dict(zip(MEANS, np.abs(model - truth).tolist(), strict=True))
    return Prediction(run.id, errors, measured)


def second_half(clock: FloatArray, pose: FloatArray) -> FloatArray:
    """Mean surge and sway speed (m/s) and yaw rate (rad/s) over the second half of a run.

    Args:
        clock: (T,) times from the start (s).
        pose: (T, 3) x, y (m) and yaw (rad), NaN where nothing was measured.
    """
    late = (clock >= 0.5 * clock[-1]) & np.isfinite(pose).all(axis=1)
    time, (x, y, yaw) = clock[late], pose[late].T
    yaw = np.unwrap(yaw)
    vx, vy = np.gradient(x, time), np.gradient(y, time)
    surge = np.mean(vx * np.cos(yaw) + vy * np.sin(yaw))
    sway = np.mean(vy * np.cos(yaw) - vx * np.sin(yaw))
    return np.array([surge, sway, np.polyfit(time, yaw, 1)[0]])


def unit_of(quantity: str) -> str:
    """SI unit of a quantity of :class:`Prediction`."""
    if quantity == "path":
        return "m"
    return MEANS.get(quantity) or BY_NAME[quantity].unit
