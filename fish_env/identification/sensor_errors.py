"""What mounting and calibration of sensors leave, as small errors that every record may have.

A marker sits beside the origin, an inertial unit is screwed on a little askew, a compass bends with
the heading, a camera looks down at an angle and into water. Each is linear in one number, with
regressors that follow from the filtered motion. So no fish has to swim again to see what it does:
the filter's own slopes carry a change of the measurements through to its innovations. Errors that
are known are part of what the filter's sensors show, but for a few that a state cannot tell: these
are taken off the samples, and the regressors are then those of the corrected motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm
from scipy.signal import butter, sosfilt

from fish_env.arrays import FloatArray
from fish_env.identification.channels import BY_NAME
from fish_env.identification.filtering import Filtered, Slopes
from fish_env.identification.first_state import told_at_start
from fish_env.identification.runs import RunData
from fish_env.identification.state_blocks import N_ERROR, N_MOVING, columns
from fish_env.identification.variation import IN_SAMPLES, SENSOR_ERRORS
from fish_env.identification.variation_slopes import leave_diverged
from fish_env.model.frames import euler_from_quaternion
from fish_env.rigidbody.kinematics import euler_rates, rotations
from fish_env.sensing.devices import devices_of, has_inertial_unit
from fish_env.sensing.geometry import CALIBRATED_DEPTH

CUTOFF_HZ, FINE_S = 5.0, 0.004
"""Usual low-pass of an inertial unit, and steps in which it is computed (s)."""
LATE_S = math.sqrt(2.0) / (2.0 * math.pi * CUTOFF_HZ)
"""By how much a Butterworth filter of second order makes slow signals late (s)."""
_LOW_PASS = butter(2, CUTOFF_HZ, fs=1.0 / FINE_S, output="sos")
_KNOWN: WeakKeyDictionary[Filtered, tuple[tuple[str | float, ...], FloatArray]]
_KNOWN = WeakKeyDictionary()
_INDEX = {error.name: i for i, error in enumerate(SENSOR_ERRORS)}
_ROWS = {"velocity": [BY_NAME[n].index for n in "uvw"], "rate": [BY_NAME[n].index for n in "pqr"]}
_ATTITUDE, _RATES, _PLACE = ("roll", "pitch", "yaw"), ("p", "q", "r"), ("x", "y", "z")


def sensor_slopes(
    clock: FloatArray,
    filtered: Filtered,
    channels: Sequence[str],
    ages: FloatArray | None = None,
) -> FloatArray:
    """Change of every sample by every sensor error, at the filtered motion, shape (T, C, K).

    Args:
        clock: (T,) times of the rows (s).
        filtered: the run filtered, with its slopes.
        channels: names of its C channels.
        ages: (devices,) how much older than its row a sample of each device is (s); default: none.

    Raises:
        ValueError: the filter kept no slopes.
        LinAlgError: the simulation has diverged.
    """
    motion = _predicted(clock, filtered)
    found = np.zeros((len(clock), len(channels), len(SENSOR_ERRORS)))
    devices = np.array(devices_of(channels))
    for device in np.unique(devices).tolist():
        age = 0.0 if ages is None else float(ages[device])
        at = {channels[i]: i for i in np.flatnonzero(devices == device).tolist()}
        seen = motion.ago(age)
        _put_mounting(found, at, seen)
        _put_camera(found, at, seen)
        for name in at.keys() & {*_ATTITUDE, *_RATES}:
            _put(found, at, name, "inertial_smoothing", motion.reshaped(name, age))
    found[:, :, [_INDEX[name] for name in _absent(channels)]] = 0.0
    return found


def _put_mounting(found: FloatArray, at: dict[str, int], motion: _Motion) -> None:
    """What markers and an inertial unit show that sit aside or askew, or have another gain."""
    turns, kinematics = rotations(motion.euler), euler_rates(motion.euler)
    for k, axis in enumerate(_PLACE):
        for j, name in enumerate(("x", "y")):
            _put(found, at, name, f"marker_{axis}", turns[:, j, k])
    for k, angle in enumerate(_ATTITUDE):
        for j, name in enumerate(_ATTITUDE):
            _put(found, at, name, f"mounting_{angle}", kinematics[:, j, k])
        swung = np.cross(motion.rates, np.eye(3)[k])
        for j, name in enumerate(_RATES):
            _put(found, at, name, f"mounting_{angle}", swung[:, j])
    for j, name in enumerate(_RATES):
        _put(found, at, name, f"gyro_gain_{name}", motion.rates[:, j])
    yaw = motion.euler[:, 2]
    for turn, label in ((1.0, ""), (2.0, "2_")):
        _put(found, at, "yaw", f"compass_sin_{label}yaw", np.sin(turn * yaw))
        _put(found, at, "yaw", f"compass_cos_{label}yaw", np.cos(turn * yaw))


def _put_camera(found: FloatArray, at: dict[str, int], motion: _Motion) -> None:
    """What a camera shows in water that drifts, from an angle, and through the surface."""
    turns, clock = rotations(motion.euler), motion.clock
    for k, (axis, name) in enumerate((("x", "current_north"), ("y", "current_east"))):
        _put(found, at, axis, name, clock - clock[0])
        for j, speed in enumerate("uvw"):
            _put(found, at, speed, name, turns[:, k, j])
    depth = motion.place[:, 2]
    _put(found, at, "x", "camera_pitch", -depth)
    _put(found, at, "y", "camera_roll", depth)
    higher = CALIBRATED_DEPTH - np.maximum(depth, 0.0)
    for j, name in enumerate(("x", "y")):
        _put(found, at, name, "camera_scale_per_depth", motion.place[:, j] * higher)


def _absent(channels: Sequence[str]) -> list[str]:
    """Sensor errors of devices that these channels do not come from, or that none of them sees."""
    absent: tuple[str, ...] = ()
    if not has_inertial_unit(channels):
        absent += ("mounting_", "compass_", "gyro_", "inertial_")
    if "z" not in channels:
        absent += ("camera_roll", "camera_pitch", "camera_scale_per_depth")
    return [name for name in _INDEX if name.startswith(absent)] if absent else []


@dataclass(frozen=True, eq=False)
class _Motion:
    """A run as predicted, one sample ahead.

    Attributes:
        clock: (T,) times (s).
        place: (T, 3) (m).
        euler: (T, 3) angles.
        rates: (T, 3) of the body.
        slopes: rate of change (T, 3) of each of these.
    """

    clock: FloatArray
    place: FloatArray
    euler: FloatArray
    rates: FloatArray
    slopes: tuple[FloatArray, FloatArray, FloatArray]

    def ago(self, age: float) -> _Motion:
        """The motion as it was some time (s) before each row.

        Between two rows it follows from both and its slopes there, and from nothing after: with
        that a regressor would follow its innovation.
        """
        if age == 0.0:
            return self
        at = np.maximum(self.clock - age, self.clock[0])
        seen = zip((self.place, self.euler, self.rates), self.slopes, strict=True)
        earlier = [np.asarray(CubicHermiteSpline(self.clock, *p)(at)) for p in seen]
        return replace(self, place=earlier[0], euler=earlier[1], rates=earlier[2])

    def reshaped(self, channel: str, age: float) -> FloatArray:
        """What an inertial unit's filter does to samples (T,) beside making them late.

        A sample that shows what was some time before its row was taken ``LATE_S`` after that. From
        the row to there the filter is carried on along the slope at the row, as nothing after the
        row may be known.

        Args:
            channel: an angle or rate.
            age: how much older than its row a sample is (s); late as the unit is, the filter of the
                motion takes that into account.
        """
        of = _ATTITUDE if channel in _ATTITUDE else _RATES
        which, column = (1 if of is _ATTITUDE else 2), of.index(channel)
        clock, slope = self.clock, self.slopes[which][:, column]
        values = (self.euler if which == 1 else self.rates)[:, column]
        even = np.arange(clock[0], clock[-1] + FINE_S, FINE_S)
        spline = CubicHermiteSpline(clock, values, slope)
        path = np.asarray(spline(np.minimum(even, clock[-1])))
        filtered = np.asarray(sosfilt(_LOW_PASS, path - values[0])) + values[0]
        ahead = LATE_S - age
        known = np.minimum(clock, clock + ahead)
        at = [np.interp(known, even, f) for f in (filtered, _backward_slope(filtered))]
        carried = _carried_on(max(ahead, 0.0)) @ np.array([*at, values, slope])
        return np.asarray(carried - spline(np.maximum(clock - age, clock[0])))


def _backward_slope(values: FloatArray) -> FloatArray:
    """Rate of change of values every ``FINE_S`` (T,), from them and the two before (BDF2)."""
    padded = np.concatenate([values[:1], values[:1], values])
    return np.asarray((3.0 * padded[2:] - 4.0 * padded[1:-1] + padded[:-2]) / (2.0 * FINE_S))


def _carried_on(ahead: float) -> FloatArray:
    """(4,) what filtered value, its slope, input and its slope each add some time (s) later."""
    omega = 2.0 * np.pi * CUTOFF_HZ
    motion = np.zeros((4, 4))
    motion[0, 1], motion[2, 3] = 1.0, 1.0
    motion[1] = [-(omega**2), -math.sqrt(2.0) * omega, omega**2, 0.0]
    return np.asarray(expm(ahead * motion)[0])


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
    rates, velocity = states[:, _ROWS["rate"]], states[:, _ROWS["velocity"]]
    change = (
        np.einsum("tij,tj->ti", rotations(euler), velocity),
        np.einsum("tij,tj->ti", kinematics, rates),
        _slope_at_end(clock, states, filtered.states),
    )
    if not all(np.isfinite(part).all() for part in (states[:, :3], euler, rates, *change)):
        raise np.linalg.LinAlgError("the simulation diverges, and shows no sensor errors")
    return _Motion(clock, states[:, :3], euler, rates, change)


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


def known_slopes(run: RunData, filtered: Filtered, channels: Sequence[str]) -> FloatArray:
    """Change of every sample of a run by every sensor error, shape (T, C, K), worked out once.

    Every step from a filtered motion asks for it, and the linear model of these steps.

    Args:
        run: the run with the numbers that it was filtered with.
        filtered: that, with its slopes.
        channels: names of its channels.

    Raises:
        ValueError: the filter kept no slopes.
        LinAlgError: the simulation has diverged.
    """
    key = (*channels, *run.own_ages.tolist())
    before, found = _KNOWN.get(filtered, (None, None))
    if found is None or before != key:
        found = sensor_slopes(run.clock, filtered, channels, run.own_ages)
        _KNOWN[filtered] = key, found
    return found


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
    parts = []
    for run, one in zip(runs, filtered, strict=True):
        changes = known_slopes(run, one, channels)
        begun = _shown_start(run, changes[0], channels)
        parts.append(innovation_slopes(run.clock, run.measured, one, correlation_s, changes, begun))
    for part in parts:
        leave_diverged(part)
    return np.concatenate(parts)


def _shown_start(run: RunData, changes: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Change of the state that a run begins in by what geometry does to its first sample (19, K).

    Args:
        run: the run.
        changes: (C, K) of the first sample.
        channels: names of the channels.
    """
    begun = np.zeros((N_ERROR, changes.shape[1]))
    if not run.as_measured:
        return begun
    names, none = told_at_start(run.swimming), np.zeros(changes.shape[1])
    told = {name: own for name, own in zip(channels, changes, strict=True) if name in names}
    begun[columns("position")] = [told.get(name, none) for name in _PLACE]
    euler = euler_from_quaternion(run.state0[3:7])[None]
    turned = np.array([told.get(name, none) for name in _ATTITUDE])
    begun[columns("rotation")] = np.linalg.solve(euler_rates(euler)[0], turned)
    begun[:, IN_SAMPLES] = 0.0
    return begun


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
    begun: FloatArray | None = None,
) -> FloatArray:
    """Change of whitened innovations by changes of the measurements, shape (T C, K).

    The filter's gains are held, as everywhere where parameters are compared.

    Args:
        clock: (T,) times of the samples (s).
        measured: (T, C), NaN where missing.
        filtered: the run filtered, with its slopes.
        correlation_s: of the disturbance that it was filtered with (s).
        changes: (T, C, K) of the measurements.
        begun: (19, K) by how much the state that the run begins in changes; None for nothing.

    Raises:
        ValueError: the filter kept no slopes.
    """
    slopes = _slopes(filtered)
    changes = np.where(np.isfinite(measured)[:, :, None], changes, 0.0)
    keep = np.exp(-np.diff(clock, prepend=clock[0]) / correlation_s)
    stray = np.zeros((N_ERROR, changes.shape[2])) if begun is None else begun
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
