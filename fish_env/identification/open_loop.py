"""Predictions without feedback: from a filtered state on, the model runs alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.model.state import BASE_STATES


class Predicting(Protocol):
    """Runs and a model of them."""

    runs: tuple[RunData, ...]

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: NoiseModel,
        filtered: Sequence[Filtered],
    ) -> FloatArray:
        """Innovations (N, residuals) of many points under given gains."""
        ...


def without_feedback(
    run: RunData, states: int = len(BASE_STATES), sd: FloatArray | None = None
) -> Filtered:
    """Gains of zero, so that "innovations" are plain prediction errors.

    Args:
        run: the run.
        states: rows of the state.
        sd: (C,) units that errors count in; default: those of the channels.
    """
    samples, channels = run.measured.shape
    units = np.eye(channels) if sd is None else np.diag(1.0 / sd)
    return Filtered(
        np.zeros((samples, len(run.covariance0), channels)),
        np.tile(units, (samples, 1, 1)),
        np.zeros((samples, channels)),
        np.ones(samples),
        np.zeros((samples, 0)),
        np.zeros((samples, states)),
        np.zeros((samples, 6)),
        0.0,
    )


def in_units_of_noise(runs: Sequence[RunData], sensor_sd: FloatArray) -> list[Filtered]:
    """Of each run, gains of zero and errors that count in units of its sensors' noise.

    Args:
        runs: the runs.
        sensor_sd: (C,) usual noise of the channels.
    """
    return [without_feedback(r, sd=sensor_sd * r.noise_scale) for r in runs]


def errors(problem: Predicting, point: Point, noise: NoiseModel) -> list[FloatArray]:
    """Measured minus predicted of each run from its initial state, (T, C), NaN where missing."""
    effects = {id: np.array([value]) for id, value in point.effects.items()}
    still = [without_feedback(run) for run in problem.runs]
    flat = problem.innovations(point.z[:, None], effects, noise, still)[0]
    parts = np.split(flat, np.cumsum([run.measured.size for run in problem.runs])[:-1])
    return [
        np.where(np.isfinite(run.measured), part.reshape(run.measured.shape), np.nan)
        for run, part in zip(problem.runs, parts, strict=True)
    ]


def windows(run: RunData, filtered: Filtered, channels: Sequence[str]) -> list[RunData]:
    """A run cut into windows that start from its filtered states.

    Effects with states of their own start where beating as commanded has left them. Time goes on
    counting from the run's start, for effects that grow with it. How far a current of the run has
    carried the fish before a window is part of where this begins: without the current, the window
    is not as far off as the whole run would be.

    Args:
        run: the run.
        filtered: its states.
        channels: names of its channels.
    """
    length = POLICY.prediction_window_s
    edges = np.arange(0.0, run.duration - 0.5 * length, length)
    starts = np.searchsorted(run.clock, edges)
    ends = np.r_[starts[1:], len(run.clock) - 1]
    return [
        _cut(run, filtered.states[first, : len(BASE_STATES)], first, last + 1, channels)
        for first, last in zip(starts, ends, strict=True)
        if last - first >= 3
    ]


def _cut(
    run: RunData, state: FloatArray, first: int, last: int, channels: Sequence[str]
) -> RunData:
    held = np.searchsorted(run.command_times, run.clock[first], side="right") - 1
    window = run.cut(first, last)
    if window.distortion is not None:
        carried = run.current * (run.clock[first] - run.clock[0])
        state, distortion = state.copy(), window.distortion.copy()
        for axis, name in enumerate(("x", "y")):
            if name in channels:
                state[axis] += carried[axis]
                distortion[:, list(channels).index(name)] -= carried[axis]
        window = replace(window, distortion=distortion)
    return replace(
        window,
        command_times=np.ascontiguousarray(run.command_times[max(held, 0) :]),
        command_values=np.ascontiguousarray(run.command_values[max(held, 0) :]),
        state0=np.ascontiguousarray(state),
        swimming=run.swimming or first > 0,
        as_measured=False,
    )
