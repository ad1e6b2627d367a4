"""Predictions without feedback: from a filtered state on, the model runs alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from fish_env.identification.filtering import Filtered, NoiseModel
from fish_env.identification.problem import Point, Problem
from fish_env.identification.runs import RunData
from fish_env.model.state import BASE_STATES

FloatArray = npt.NDArray[np.float64]


def without_feedback(
    run: RunData, states: int = len(BASE_STATES), corners: bool = False
) -> Filtered:
    """Gains of zero, so that "innovations" are plain prediction errors."""
    samples, channels = run.measured.shape
    return Filtered(
        np.zeros((samples, len(run.covariance0), channels)),
        np.tile(np.eye(channels), (samples, 1, 1)),
        np.zeros((samples, channels)),
        np.zeros((samples, states)),
        np.zeros((samples, 6)),
        0.0,
        corners=corners,
    )


def errors(problem: Problem, point: Point, noise: NoiseModel) -> list[FloatArray]:
    """Measured minus predicted of each run from its initial state, (T, C), NaN where missing."""
    effects = {path: np.array([value]) for path, value in point.effects.items()}
    corners = problem.has_corners(point.effects)
    still = [without_feedback(run, corners=corners) for run in problem.runs]
    flat = problem.innovations(point.z[:, None], effects, noise, still)[0]
    parts = np.split(flat, np.cumsum([run.measured.size for run in problem.runs])[:-1])
    return [
        np.where(np.isfinite(run.measured), part.reshape(run.measured.shape), np.nan)
        for run, part in zip(problem.runs, parts, strict=True)
    ]


def windows(run: RunData, filtered: Filtered, length_s: float) -> list[RunData]:
    """A run cut into windows that start from its filtered states.

    Effects with states of their own start where beating as commanded has left them. Time goes on
    counting from the run's start, for effects that grow with it.
    """
    edges = np.arange(0.0, run.duration - 0.5 * length_s, length_s)
    starts = np.searchsorted(run.clock, edges)
    ends = np.r_[starts[1:], len(run.clock) - 1]
    return [
        _cut(run, filtered.states[first, : len(BASE_STATES)], first, last + 1)
        for first, last in zip(starts, ends, strict=True)
        if last - first >= 3
    ]


def _cut(run: RunData, state: FloatArray, first: int, last: int) -> RunData:
    held = np.searchsorted(run.command_times, run.clock[first], side="right") - 1
    return replace(
        run.cut(first, last),
        command_times=np.ascontiguousarray(run.command_times[max(held, 0) :]),
        command_values=np.ascontiguousarray(run.command_values[max(held, 0) :]),
        state0=np.ascontiguousarray(state),
        swimming=run.swimming or first > 0,
        as_measured=False,
    )
