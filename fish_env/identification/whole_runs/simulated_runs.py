"""What an estimate of the runs' own numbers asks of a problem of whole runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from fish_env.arrays import FloatArray
from fish_env.identification.parameters import Baseline
from fish_env.identification.whole_runs.noise import SimulationNoise
from fish_env.identification.whole_runs.own_numbers import OwnNumbers
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point


class SimulatedRuns(Protocol):
    """Runs that a model simulates from their start to their end."""

    @property
    def baseline(self) -> Baseline:
        """Free coefficients."""

    @property
    def own(self) -> tuple[OwnNumbers, ...]:
        """What is free in each run."""

    @property
    def pace(self) -> float | None:
        """Tail frequency over that of the model, held in all runs; None: free in each."""

    @property
    def run_count(self) -> int:
        """Number of runs."""

    def some(self, runs: Sequence[int]) -> SimulatedRuns:
        """The same on some of the runs."""

    def until(self, end_s: float) -> SimulatedRuns:
        """The same on the beginnings of the runs."""

    def spread(self, count: int) -> list[int]:
        """Which runs stand for all: at most ``count`` of them."""

    def default_noise(self) -> SimulationNoise:
        """Noise model before any fit."""

    def scale_at(self, point: Point) -> float:
        """Beat over commanded frequency of the model at a point."""

    def errors(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        own: Sequence[FloatArray],
        runs: Sequence[int] | None = None,
    ) -> list[FloatArray]:
        """Measured less simulated (N, T, C) of each run, SI."""

    def whitened(
        self, errors: FloatArray, own: FloatArray, noise: SimulationNoise, run: int
    ) -> FloatArray:
        """Residuals (N, D_r) of a run."""
