"""Where a goal goes, told by how its rate has changed so far."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray

SLOWEST, FASTEST = 1e-3, 0.45
"""Angular frequencies (rad/s) that a goal is taken to swing with."""


class Course:
    """Takes goals for sines whose frequency it learns; a ramp is a very slow one.

    With rate r and bend b = r', a sine has b' = -omega^2 r; omega^2 is the least-squares ratio of
    the two over the episode. Steps, and ramps that begin and end, come unforeseen.

    Args:
        largest_bend: a faster change of the rate is a jump and says nothing (per s^2).
        period_s: between two observations (s).
    """

    def __init__(self, largest_bend: float, period_s: float) -> None:
        self._largest, self._period = largest_bend, period_s
        self.reset(1)

    def reset(self, count: int) -> None:
        """Episodes of ``count`` fish begin."""
        self.rate, self.bend, self._products, self._squares = np.zeros((4, count))
        self._seen = 0

    def see(self, rate: FloatArray) -> None:
        """Takes the next rates (N,) of the goals."""
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
        """Angular frequencies (N,) of the goals (rad/s)."""
        square = self._products / np.maximum(self._squares, 1e-9)
        return np.sqrt(np.clip(square, SLOWEST**2, FASTEST**2))

    @property
    def fastest(self) -> FloatArray:
        """Largest rates (N,) that the goals reach in a swing."""
        return np.hypot(self.rate, self.bend / self.omega)

    def rate_in(self, ahead_s: float | FloatArray) -> FloatArray:
        """Rates (N,) of the goals so much later."""
        phase = self.omega * ahead_s
        return np.asarray(self.rate * np.cos(phase) + self.bend * np.sin(phase) / self.omega)

    def change_in(self, ahead_s: float | FloatArray) -> FloatArray:
        """How far the goals move until so much later, (N,)."""
        omega, phase = self.omega, self.omega * ahead_s
        swing = self.bend * (1.0 - np.cos(phase)) / omega**2
        return np.asarray(self.rate * np.sin(phase) / omega + swing)
