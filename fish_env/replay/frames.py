"""Poses on an even clock, as the page draws them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from fish_env.arrays import FloatArray

RATE_HZ = 40.0
"""Twenty pictures a beat at 2 Hz; the page interpolates between them."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Pose, tail and weight block, evenly spaced in time.

    Attributes:
        start_s: Time of the first frame, s.
        step_s: Time between frames, s.
        position: (m, 3) of O_b, inertial NED, m.
        quaternion: (m, 4) body to inertial, scalar first.
        tail_angle: (m,) rad.
        block: (m, 2) displacement, m, and angle, rad.
    """

    start_s: float
    step_s: float
    position: FloatArray
    quaternion: FloatArray
    tail_angle: FloatArray
    block: FloatArray


def frames_of(
    time_s: FloatArray,
    position: FloatArray,
    attitude: Rotation,
    tail_angle: FloatArray,
    block: FloatArray,
    actuator_time_s: FloatArray | None = None,
) -> Frames:
    """Resamples a motion; positions by monotone cubics, attitudes along the shortest arc.

    Args:
        time_s: Increasing times, shape (n,), s.
        position: (n, 3).
        attitude: n attitudes.
        tail_angle: (k,) rad.
        block: (k, 2).
        actuator_time_s: (k,) times of tail and block; default: `time_s`.
    """
    actuator_time = time_s if actuator_time_s is None else actuator_time_s
    span = float(time_s[-1] - time_s[0])
    count = max(2, int(np.ceil(span * RATE_HZ)) + 1)
    clock = np.linspace(time_s[0], time_s[-1], count)
    return Frames(
        float(time_s[0]),
        span / (count - 1),
        PchipInterpolator(time_s, position)(clock),
        Slerp(time_s, attitude)(clock).as_quat(scalar_first=True),
        np.interp(clock, actuator_time, tail_angle),
        np.column_stack([np.interp(clock, actuator_time, block[:, i]) for i in range(2)]),
    )


def filled(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """A series whose gaps are bridged by straight lines, and whose ends are held."""
    present = np.isfinite(values)
    if present.all():
        return values
    return np.asarray(np.interp(time_s, time_s[present], values[present]))
