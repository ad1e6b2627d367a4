"""How innovations change with what runs differ in, where the fish has to swim again for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered, Measurement, RunFilter
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.tail_drive import RATE, SCALE, TailDrive
from fish_env.identification.variation import BEAT, SAG, unseen
from fish_env.inference.estimate.free import diverged
from fish_env.inference.hypotheses import EffectParameterId, effects_of
from fish_env.inference.problem import Point


class Swimming(Protocol):
    """Runs and the filter on them."""

    runs: tuple[RunData, ...]
    channels: tuple[str, ...]
    drive: TailDrive

    def neutral(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        ...

    def lanes(
        self, z: FloatArray, effects: Mapping[EffectParameterId, FloatArray]
    ) -> tuple[FloatArray, Measurement]:
        """Parameter records (parameters, N) and what the sensors do, for N points."""
        ...

    def filter_for(self, effects: Iterable[EffectParameterId]) -> RunFilter:
        """The quickest filter that computes with these effect parameters."""
        ...


def swum_slopes(
    problem: Swimming,
    point: Point,
    noise: NoiseModel,
    filtered: Sequence[Filtered],
    steps: FloatArray,
) -> FloatArray:
    """(D, K) change of each innovation with its own run's numbers, by differences.

    A run's commands hold its beat, so the model's own effects change that. Where runs share one
    beat none has another.

    Args:
        problem: the runs.
        point: values of the shared parameters.
        noise: noise model.
        filtered: evaluation at the point.
        steps: (K,) of each number, see ``variation.VARIATIONS``.
    """
    count = 1 + len(steps)
    beats = effects_of((SCALE, RATE)) if problem.drive.uneven else ()
    told = {**problem.neutral(beats), **point.effects}
    effects = {id: np.full(count, value) for id, value in told.items()}
    if problem.drive.uneven:
        effects[SCALE][1 + BEAT] *= 1.0 + steps[BEAT]
        effects[RATE][1 + SAG] += steps[SAG]
    more = np.column_stack([np.zeros(len(steps)), np.diag(steps)])
    more[[BEAT, SAG]] = 0.0
    lanes = problem.lanes(np.repeat(point.z[:, None], count, axis=1), effects)
    rows = problem.filter_for(effects).innovations(*lanes, noise, filtered, variation=more)
    slopes = np.asarray((rows[1:] - rows[0]).T / steps)
    ends = np.cumsum([run.measured.size for run in problem.runs])[:-1]
    for own in np.split(slopes, ends):
        leave_diverged(own)
    slopes[:, unseen(problem.channels)] = 0.0
    return slopes


def leave_diverged(slopes: FloatArray) -> None:
    """Give numbers of a run by which its simulation diverges no slope, in place: they stay.

    Args:
        slopes: (D, K) of the innovations of one run.
    """
    slopes[:, diverged(slopes.T)] = 0.0
