"""How far a simulation may stray from a whole run, and what weights follow from that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.runs import RunData

SPEED_CHANNELS = {"x": 0, "y": 0, "z": 0, "roll": 1, "pitch": 1, "yaw": 1}
"""Channels that integrate a speed (0) or a rate (1)."""
DRIFTS = ((0.003, 0.02, 3.0), (0.0015, 0.008, 5.0))
"""Errors of speed (m/s) and rate (rad/s), and how long they last (s), that the first and the second
fit of a series allow for: a start far off then still finds its way."""


@dataclass(frozen=True)
class SimulationNoise:
    """Errors of a simulation over a whole run.

    They are far above the sensors' noise, because a model is never that good. With the sensors'
    own weights the shape of a beat, which no coefficient gets right, would decide over speed and
    yaw rate, which a prediction is for.

    Attributes:
        sd: (C,) standard deviation of each channel, SI.
        samples: (C,) samples of a run that count as independent.
        speed_sd: error of speeds beside that (m/s), which dies out and is integrated.
        rate_sd: the same of angular rates (rad/s).
        memory_s: time after which such an error is forgotten (s).
    """

    sd: tuple[float, ...]
    samples: tuple[float, ...]
    speed_sd: float = 0.0
    rate_sd: float = 0.0
    memory_s: float = 3.0

    def is_close(self, other: SimulationNoise, share: float) -> bool:
        """Whether another noise model differs by less than a share of this one."""
        ratios = np.log(np.array([other.sd, other.samples]) / np.array([self.sd, self.samples]))
        return bool(np.abs(ratios).max() < share)

    def counted(self, run: RunData) -> FloatArray:
        """(C,) samples of a run that count."""
        measured = np.isfinite(run.measured).sum(axis=0)
        return np.asarray(np.minimum(measured, np.maximum(self.samples, 1.0)))

    def whitening(self, run: RunData, channels: Sequence[str]) -> list[FloatArray]:
        """Of each channel, the matrix (T, T) that makes its errors in a run white.

        Rows and columns of samples that were not measured are zero.
        """
        counted, found = self.counted(run), []
        for i, name in enumerate(channels):
            good = np.isfinite(run.measured[:, i])
            time = run.clock[good]
            white = np.zeros((len(good), len(good)))
            if len(time):
                own = self.sd[i] ** 2 * len(time) / counted[i] * np.eye(len(time))
                slow = (
                    (self.speed_sd, self.rate_sd)[SPEED_CHANNELS[name]]
                    if (name in SPEED_CHANNELS)
                    else 0.0
                )
                if slow > 0.0:
                    own += slow**2 * integrated_ou(time, self.memory_s)
                white[np.ix_(good, good)] = np.linalg.inv(np.linalg.cholesky(own))
            found.append(white)
        return found


def integrated_ou(time_s: FloatArray, memory_s: float) -> FloatArray:
    """Covariance (n, n) of the integral from 0 of a unit process with exponential memory."""
    early = np.minimum(time_s[:, None], time_s)
    late = np.maximum(time_s[:, None], time_s)
    m = memory_s
    return np.asarray(
        2.0 * m * early
        + m**2 * (np.exp(-early / m) + np.exp(-late / m) - 1.0 - np.exp(-(late - early) / m))
    )


def independent_samples(errors: Sequence[FloatArray]) -> float:
    """How many samples of a run count as independent, mean over runs.

    The autocorrelation of all runs is summed up to its first value below zero.

    Args:
        errors: (T,) of each run, NaN where nothing was measured.
    """
    longest = max(len(own) for own in errors)
    products, power = np.zeros(longest), 0.0
    for own in errors:
        filled = np.nan_to_num(own)
        size = 2 * len(filled)
        spectrum = np.abs(np.fft.rfft(filled, size)) ** 2
        products[: len(filled)] += np.fft.irfft(spectrum, size)[: len(filled)]
        power += float(filled @ filled)
    alike = products / max(power, 1e-300)
    negative = np.flatnonzero(alike <= 0.0)
    until = int(negative[0]) if len(negative) else longest
    lasting = 1.0 + 2.0 * float(alike[1:until].sum())
    return float(np.mean([np.isfinite(own).sum() for own in errors]) / lasting)
