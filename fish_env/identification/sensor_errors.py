"""What mounting and calibration of sensors leave, as small errors that every record may have.

A marker sits beside the origin, an inertial unit is screwed on a little askew, a compass bends with
the heading, a camera looks down at an angle and into water. Each is linear in one number, with
regressors that follow from the filtered motion. So no fish has to swim again to see what it does:
the filter's own slopes carry a change of the measurements through to its innovations. Errors that
are known are taken off the samples, and the regressors are then those of the corrected motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import butter, sosfilt

from fish_env.arrays import FloatArray
from fish_env.identification.channels import BY_NAME, has_inertial_unit
from fish_env.identification.filtering import Filtered, Slopes
from fish_env.identification.runs import RunData
from fish_env.identification.state_blocks import N_ERROR, N_MOVING, columns
from fish_env.identification.variation import SENSOR_ERRORS
from fish_env.identification.variation_slopes import leave_diverged
from fish_env.model.frames import euler_from_quaternion
from fish_env.rigidbody.kinematics import euler_rates, rotations

CUTOFF_HZ, FINE_S = 5.0, 0.004
"""Usual low-pass of an inertial unit, and steps in which it is computed (s)."""
LATE_S = math.sqrt(2.0) / (2.0 * math.pi * CUTOFF_HZ)
"""By how much a Butterworth filter of second order makes slow signals late (s)."""
_LOW_PASS = butter(2, CUTOFF_HZ, fs=1.0 / FINE_S, output="sos")
_INDEX = {error.name: i for i, error in enumerate(SENSOR_ERRORS)}
_ROWS = {"velocity": [BY_NAME[n].index for n in "uvw"], "rate": [BY_NAME[n].index for n in "pqr"]}
_ATTITUDE, _RATES, _PLACE = ("roll", "pitch", "yaw"), ("p", "q", "r"), ("x", "y", "z")


def sensor_slopes(clock: FloatArray, filtered: Filtered, channels: Sequence[str]) -> FloatArray:
    """Change of every sample by every sensor error, at the filtered motion, shape (T, C, K).

    Args:
        clock: (T,) times of the samples (s).
        filtered: the run filtered, with its slopes.
        channels: names of its C channels.

    Raises:
        ValueError: the filter kept no slopes.
        LinAlgError: the simulation has diverged.
    """
    motion = _predicted(clock, filtered)
    states, euler = motion.states, motion.euler
    rates = states[:, _ROWS["rate"]]
    place = states[:, :3] - states[0, :3]
    found = np.zeros((len(euler), len(channels), len(SENSOR_ERRORS)))
    at = {name: i for i, name in enumerate(channels)}
    for name in (*_ATTITUDE, *_RATES):
        if name in at:
            reshaped = _reshaped(clock, motion.of(name), motion.change[name])
            _put(found, at, name, "inertial_smoothing", reshaped)
    turns, kinematics = rotations(euler), euler_rates(euler)
    for k, axis in enumerate(_PLACE):
        for j, name in enumerate(_PLACE):
            _put(found, at, name, f"marker_{axis}", turns[:, j, k])
    for k, angle in enumerate(_ATTITUDE):
        for j, name in enumerate(_ATTITUDE):
            _put(found, at, name, f"mounting_{angle}", kinematics[:, j, k])
        swung = np.cross(rates, np.eye(3)[k])
        for j, name in enumerate(_RATES):
            _put(found, at, name, f"mounting_{angle}", swung[:, j])
    for j, name in enumerate(_RATES):
        _put(found, at, name, f"gyro_gain_{name}", rates[:, j])
    yaw = euler[:, 2]
    for turn, label in ((1.0, ""), (2.0, "2_")):
        _put(found, at, "yaw", f"compass_sin_{label}yaw", np.sin(turn * yaw))
        _put(found, at, "yaw", f"compass_cos_{label}yaw", np.cos(turn * yaw))
    for k, (axis, name) in enumerate((("x", "current_north"), ("y", "current_east"))):
        _put(found, at, axis, name, clock - clock[0])
        for j, speed in enumerate("uvw"):
            _put(found, at, speed, name, turns[:, k, j])
    depth = place[:, 2]
    _put(found, at, "x", "camera_pitch", depth)
    _put(found, at, "y", "camera_roll", -depth)
    for j, name in enumerate(("x", "y")):
        _put(found, at, name, "camera_scale_per_depth", -place[:, j] * depth)
    found[:, :, [_INDEX[name] for name in _absent(channels)]] = 0.0
    return found


def _absent(channels: Sequence[str]) -> list[str]:
    """Sensor errors of devices that these channels do not come from, or that none of them sees."""
    absent: tuple[str, ...] = ()
    if not has_inertial_unit(channels):
        absent += ("mounting_", "compass_", "gyro_", "inertial_")
    if "z" not in channels:
        absent += ("camera_roll", "camera_pitch", "camera_scale_per_depth")
    return [name for name in _INDEX if name.startswith(absent)] if absent else []


def _reshaped(clock: FloatArray, values: FloatArray, rate: FloatArray) -> FloatArray:
    """What an inertial unit's filter does to samples (T,) beside making them late.

    How late the unit is the filter of the motion takes into account. Between two samples the
    channel follows from both and its rates there, and from none after: with that the regressor
    would follow its innovation.
    """
    even = np.arange(clock[0], clock[-1] + FINE_S, FINE_S)
    path = CubicHermiteSpline(clock, values, rate)(np.minimum(even, clock[-1]))
    filtered = np.asarray(sosfilt(_LOW_PASS, path - values[0])) + values[0]
    late = np.interp(even - LATE_S, even, path)
    return np.asarray(np.interp(clock, even, filtered - late))


@dataclass(frozen=True, eq=False)
class _Motion:
    """A run as predicted, one sample ahead.

    Attributes:
        states: (T, states).
        euler: (T, 3) angles.
        change: rate of change (T,) of each angle and angular rate.
    """

    states: FloatArray
    euler: FloatArray
    change: dict[str, FloatArray]

    def of(self, channel: str) -> FloatArray:
        """An angle or rate (T,)."""
        if channel in _ATTITUDE:
            return self.euler[:, _ATTITUDE.index(channel)]
        return self.states[:, BY_NAME[channel].index]


def _predicted(clock: FloatArray, filtered: Filtered) -> _Motion:
    """The motion as predicted.

    A sample's own noise is in the filtered state, and would make its regressor follow its
    innovation. The prediction from the samples before is free of it.

    Raises:
        LinAlgError: the simulation has diverged.
    """
    slopes = _slopes(filtered)
    moved = np.einsum("tec,tc->te", filtered.gains, np.nan_to_num(slopes.raw))
    states = filtered.states.copy()
    for name in ("velocity", "rate"):
        states[:, _ROWS[name]] -= moved[:, columns(name)]
    states[:, :3] -= moved[:, columns("position")]
    euler = np.unwrap(euler_from_quaternion(states[:, 3:7]), axis=0)
    kinematics = euler_rates(euler)
    euler -= np.einsum("tij,tj->ti", kinematics, moved[:, columns("rotation")])
    change = dict(zip(_RATES, _slope_at_end(clock, states, filtered.states).T, strict=True))
    turn = np.einsum("tij,tj->ti", kinematics, states[:, _ROWS["rate"]])
    change |= dict(zip(_ATTITUDE, turn.T, strict=True))
    if not all(np.isfinite(rate).all() for rate in change.values()):
        raise np.linalg.LinAlgError("the simulation diverges, and shows no sensor errors")
    return _Motion(states, euler, change)


def _slope_at_end(clock: FloatArray, predicted: FloatArray, filtered: FloatArray) -> FloatArray:
    """Angular acceleration (T, 3) at each sample, from what the last two intervals have changed."""
    rows, step = _ROWS["rate"], np.maximum(np.diff(clock, prepend=clock[0] - 1.0), 1e-9)
    before = np.vstack([predicted[:1, rows], filtered[:-1, rows]])
    mean = (predicted[:, rows] - before) / step[:, None]
    earlier = np.vstack([mean[:1], mean[:-1]])
    return np.asarray(1.5 * mean - 0.5 * earlier)


def _slopes(filtered: Filtered) -> Slopes:
    if filtered.slopes is None:
        raise ValueError("filter the run with keep_slopes=True")
    return filtered.slopes


def slopes_of_runs(
    runs: Sequence[RunData],
    filtered: Sequence[Filtered],
    channels: Sequence[str],
    correlation_s: float,
) -> FloatArray:
    """Change of whitened innovations by each run's own sensor errors, shape (D, K).

    Args:
        runs: prepared runs.
        filtered: each of them filtered, with its slopes.
        channels: names of their channels.
        correlation_s: of the disturbance that they were filtered with (s).
    """
    parts = [
        innovation_slopes(
            run.clock, run.measured, one, correlation_s,
            sensor_slopes(run.clock, one, channels),
        )
        for run, one in zip(runs, filtered, strict=True)
    ]  # fmt: skip
    for part in parts:
        leave_diverged(part)
    return np.concatenate(parts)


def _put(
    found: FloatArray, at: dict[str, int], channel: str, error: str, values: FloatArray
) -> None:
    if channel in at:
        found[:, at[channel], _INDEX[error]] += values


def innovation_slopes(
    clock: FloatArray,
    measured: FloatArray,
    filtered: Filtered,
    correlation_s: float,
    changes: FloatArray,
) -> FloatArray:
    """Change of whitened innovations by changes of the measurements, shape (T C, K).

    The filter's gains are held, as everywhere where parameters are compared.

    Args:
        clock: (T,) times of the samples (s).
        measured: (T, C), NaN where missing.
        filtered: the run filtered, with its slopes.
        correlation_s: of the disturbance that it was filtered with (s).
        changes: (T, C, K) of the measurements.

    Raises:
        ValueError: the filter kept no slopes.
    """
    slopes = _slopes(filtered)
    changes = np.where(np.isfinite(measured)[:, :, None], changes, 0.0)
    keep = np.exp(-np.diff(clock, prepend=clock[0]) / correlation_s)
    stray = np.zeros((N_ERROR, changes.shape[2]))
    found = np.empty_like(changes)
    for t in range(len(clock)):
        if t:
            moved = stray.copy()
            moved[:N_MOVING] = slopes.motion[t] @ stray
            moved[N_MOVING:-1] *= keep[t]
            stray = moved
        raw = changes[t] - slopes.channels[t] @ stray
        found[t] = filtered.whitening[t] @ raw
        stray = stray + filtered.gains[t] @ raw
    return found.reshape(-1, changes.shape[2])
