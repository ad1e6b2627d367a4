"""The low-pass filter inside an inertial unit: a Butterworth filter of second order.

Source: Oppenheim and Schafer, Discrete-Time Signal Processing, section 5.1 and appendix B.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm
from scipy.signal import butter, sosfilt

from fish_env.arrays import FloatArray
from fish_env.sensing.devices import late_s

FINE_S = 0.004
"""Steps in which the filter is computed (s)."""


@dataclass(frozen=True, eq=False)
class Foreseen:
    """A motion in rows, and what is foreseen in each of them of the next one.

    Attributes:
        clock: (T,) times of the rows (s), evenly spaced where anything is foreseen.
        values: (T,).
        slope: (T,) rate of change.
        next_values: (T,) foreseen one row later.
        next_slope: (T,) likewise.
    """

    clock: FloatArray
    values: FloatArray
    slope: FloatArray
    next_values: FloatArray
    next_slope: FloatArray

    @property
    def bends(self) -> tuple[FloatArray, FloatArray]:
        """Second and third derivative (T,) of the cubic from each row to what is foreseen."""
        step = float(np.median(np.diff(self.clock)))
        mean = (self.next_values - self.values) / step
        second = (6.0 * mean - 4.0 * self.slope - 2.0 * self.next_slope) / step
        third = 6.0 * (self.slope + self.next_slope - 2.0 * mean) / step**2
        return second, third


def reshaped(motion: Foreseen, age: float, cutoff_hz: float) -> FloatArray:
    """What the filter does to samples (T,) beside making them late.

    A sample that shows what was some time before its row was taken later than that, by the delay of
    the filter. From the row to there the filter is carried on along what is foreseen in the row, as
    nothing that is measured after it may be known.

    Args:
        motion: what is filtered.
        age: how much older than its row a sample is (s).
        cutoff_hz: of the filter.
    """
    clock, values = motion.clock, motion.values
    even = np.arange(clock[0], clock[-1] + FINE_S, FINE_S)
    spline = CubicHermiteSpline(clock, values, motion.slope)
    path = np.asarray(spline(np.minimum(even, clock[-1])))
    filtered = np.asarray(sosfilt(_sections(cutoff_hz), path - values[0])) + values[0]
    ahead = late_s(cutoff_hz) - age
    known = np.minimum(clock, clock + ahead)
    at = [np.interp(known, even, f) for f in (filtered, _backward_slope(filtered))]
    state = np.array([*at, values, motion.slope, *motion.bends])
    carried = _carried_on(max(ahead, 0.0), cutoff_hz) @ state
    return np.asarray(carried - spline(np.maximum(clock - age, clock[0])))


@lru_cache
def _sections(cutoff_hz: float) -> FloatArray:
    return np.asarray(butter(2, cutoff_hz, fs=1.0 / FINE_S, output="sos"))


def _backward_slope(values: FloatArray) -> FloatArray:
    """Rate of change of values every ``FINE_S`` (T,), from them and the two before (BDF2)."""
    padded = np.concatenate([values[:1], values[:1], values])
    return np.asarray((3.0 * padded[2:] - 4.0 * padded[1:-1] + padded[:-2]) / (2.0 * FINE_S))


def _carried_on(ahead: float, cutoff_hz: float) -> FloatArray:
    """(6,) what filtered value, its slope, input and its derivatives each add some time (s) later.

    The derivatives of the input are the first three.
    """
    omega = 2.0 * np.pi * cutoff_hz
    motion = np.zeros((6, 6))
    motion[0, 1] = motion[2, 3] = motion[3, 4] = motion[4, 5] = 1.0
    motion[1, :3] = [-(omega**2), -math.sqrt(2.0) * omega, omega**2]
    return np.asarray(expm(ahead * motion)[0])
