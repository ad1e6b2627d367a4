"""Measured runs under constant commands, and how far a good model may stray from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset, Run
from fish_env.data.vocabulary import COMMANDS
from fish_env.errors import DatasetError

CHANNELS = ("x", "y", "yaw")
FREQUENCY = tuple(COMMANDS).index("tail_frequency")
START_S = 2.0
"""Beginning of a run from which velocities are guessed."""
PACES = np.linspace(0.8, 1.2, 401)


@dataclass(frozen=True)
class Weights:
    """How far a run may stray from a perfect model.

    Attributes:
        position_sd, angle_sd: of the camera, m and rad.
        speed_sd, rate_sd: of speed (m/s) and yaw rate (rad/s) errors.
        memory_s: time after which such an error is forgotten.
        samples: how many samples of a run count as independent.
        span_s: length of a run from which on errors count by their growth over time: longer
            runs are weighed down in proportion. Infinite: all errors count alike.
    """

    position_sd: float = 0.0012
    angle_sd: float = 0.02
    speed_sd: float = 0.003
    rate_sd: float = 0.02
    memory_s: float = 3.0
    samples: float = np.inf
    span_s: float = np.inf

    def whitening(self, time_s: FloatArray, angle: bool) -> FloatArray:
        """Matrix that makes errors at these times white, shape (n, n)."""
        slow = self.rate_sd if angle else self.speed_sd
        quick = self.angle_sd if angle else self.position_sd
        quick *= max(1.0, len(time_s) / self.samples) ** 0.5
        quick *= max(1.0, float(time_s[-1]) / self.span_s)
        covariance = slow**2 * integrated_ou(time_s, self.memory_s)
        covariance += quick**2 * np.eye(len(time_s))
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def integrated_ou(time_s: FloatArray, memory_s: float) -> FloatArray:
    """Covariance of the integral from 0 of a unit process with exponential memory, (n, n)."""
    early = np.minimum(time_s[:, None], time_s)
    late = np.maximum(time_s[:, None], time_s)
    m = memory_s
    return np.asarray(
        2.0 * m * early
        + m**2 * (np.exp(-early / m) + np.exp(-late / m) - 1.0 - np.exp(-(late - early) / m))
    )


@dataclass(frozen=True, eq=False)
class Track:
    """A measured run as the fit reads it.

    Attributes:
        id, condition: of the run.
        time_s: from the first sample, shape (n,).
        measured: x, y, unwrapped yaw, shape (n, 3), NaN where missing.
        command: shape (5,).
    """

    id: str
    condition: str
    time_s: FloatArray
    measured: FloatArray
    command: FloatArray

    def until(self, end_s: float) -> Track:
        """The beginning of the run."""
        kept = self.time_s <= end_s
        return replace(self, time_s=self.time_s[kept], measured=self.measured[kept])

    @cached_property
    def pace(self) -> float:
        """Tail frequency over the commanded one: that of the yaw's swaying."""
        if self.command[FREQUENCY] * self.time_s[-1] < 2.0:
            return 1.0
        span = 2.0 * self.time_s / self.time_s[-1] - 1.0
        slow = np.polynomial.legendre.legvander(span, min(8, 3 + int(self.time_s[-1] // 3.0)))
        return float(min(PACES, key=lambda pace: self._left(slow, self.measured[:, 2], pace)))

    def _left(self, slow: FloatArray, values: FloatArray, pace: float) -> float:
        """Sum of squares beyond slow functions and a sine of this pace."""
        beat = 2.0 * np.pi * self.command[FREQUENCY] * pace * self.time_s
        basis = np.column_stack([slow, np.sin(beat), np.cos(beat)])
        good = np.isfinite(values)
        found = np.linalg.lstsq(basis[good], values[good], rcond=None)[0]
        return float(np.sum((values[good] - basis[good] @ found) ** 2))

    @cached_property
    def start(self) -> FloatArray:
        """Pose, velocity and yaw rate by lines through the first seconds; tail phase unknown."""
        early = (self.time_s <= START_S) & np.isfinite(self.measured).all(axis=1)
        time = self.time_s[early]
        beat = 2.0 * np.pi * self.command[FREQUENCY] * self.pace * time
        basis = np.column_stack([np.ones_like(time), time, np.sin(beat), np.cos(beat)])
        found = np.linalg.lstsq(basis, self.measured[early], rcond=None)[0]
        (x, y, yaw), (vx, vy, rate) = found[0], found[1]
        along = vx * np.cos(yaw) + vy * np.sin(yaw)
        return np.array([x, y, yaw, max(along, 0.0), 0.0, rate, 0.0, self.pace])


def track_of(run: Run) -> Track:
    """A run with constant commands.

    Raises:
        DatasetError: the commands change, or x, y and yaw were not all measured.
    """
    if len(run.commands.values) > 1:
        raise DatasetError(f"run {run.id}: its commands change; give runs under constant commands")
    if not set(CHANNELS) <= set(run.channels):
        raise DatasetError(
            f"run {run.id}: whole runs are judged by x, y and yaw; measure all three"
        )
    measured = np.column_stack([run.channels[name] for name in CHANNELS])
    measured[:, 2] = np.unwrap(measured[:, 2])
    time = run.time_s - run.time_s[0]
    return Track(run.id, run.condition or run.id, time, measured, run.commands.values[0])


def tracks_of(dataset: Dataset) -> tuple[Track, ...]:
    """All runs of a dataset."""
    return tuple(track_of(run) for run in dataset.runs)
