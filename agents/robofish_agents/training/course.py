"""Extrapolates a goal from the past changes of its rate."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray

SLOWEST, FASTEST = 1e-3, 0.45
"""Angular frequencies (rad/s) that a goal is taken to swing with."""


class Course:
    """Models goals as sines whose frequency it estimates; a ramp is a very slow sine.

    With rate r and bend b = r', a sine has b' = -omega^2 r; omega^2 is the least-squares ratio of
    the two over the episode. Steps, and the ends of ramps, are not predicted.

    Args:
        largest_bend: a faster change of the rate is a jump and is not used (per s^2).
        period_s: between two observations (s).
    """

    def __init__(self, largest_bend: float, period_s: float) -> None:
        self._largest, self._period = largest_bend, period_s
        self.reset(1)

    def reset(self, count: int) -> None:
        """Begins the episodes of ``count`` fish."""
        self.rate, self.bend, self._products, self._squares = np.zeros((4, count))
        self._seen = 0

    def see(self, rate: FloatArray) -> None:
        """Updates the estimate with the next rates (N,) of the goals."""
        bend = (rate - self.rate) / self._period
        bend = np.where((np.abs(bend) > self._largest) | (self._seen == 0), 0.0, bend)
        if self._seen > 0:
            change = (bend - self.bend) / self._period
            smooth = np.abs(change) < self._largest
            self._products -= np.where(smooth, change * self.rate, 0.0)
            self._squares += np.where(smooth, self.rate**2, 0.0)
        self.rate, self.bend = rate.copy(), bend
        self._seen += 1

    @property
    def omega(self) -> FloatArray:
        """Returns the angular frequencies (N,) of the goals (rad/s)."""
        square = self._products / np.maximum(self._squares, 1e-9)
        return np.sqrt(np.clip(square, SLOWEST**2, FASTEST**2))

    @property
    def fastest(self) -> FloatArray:
        """Returns the largest rates (N,) of the goals in a period."""
        return np.hypot(self.rate, self.bend / self.omega)

    def rate_in(self, ahead_s: float | FloatArray) -> FloatArray:
        """Returns the rates (N,) of the goals after a time."""
        phase = self.omega * ahead_s
        return np.asarray(self.rate * np.cos(phase) + self.bend * np.sin(phase) / self.omega)

    def change_in(self, ahead_s: float | FloatArray) -> FloatArray:
        """Returns the change (N,) of the goals over a time."""
        omega, phase = self.omega, self.omega * ahead_s
        swing = self.bend * (1.0 - np.cos(phase)) / omega**2
        return np.asarray(self.rate * np.sin(phase) / omega + swing)
