"""What mounting and calibration of sensors leave, as small errors that every record may have.

A marker sits beside the origin, an inertial unit is screwed on a little askew, a compass bends with
the heading, a camera looks down at an angle and into water, devices are late by some hundredths of
a second. Each is linear in one number, with regressors that follow from the filtered motion. So no
fish has to swim again to see what it does: the filter's own slopes carry a change of the
measurements through to its innovations. Errors that are known are taken off the samples, and the
regressors are then those of the corrected motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicHermiteSpline, make_interp_spline
from scipy.signal import butter, sosfilt

from fish_env.arrays import FloatArray
from fish_env.identification.channels import BY_NAME
from fish_env.identification.filtering import Filtered, Slopes
from fish_env.identification.runs import RunData
from fish_env.identification.state_blocks import N_ERROR, N_MOVING, columns
from fish_env.identification.variation import SENSOR_ERRORS
from fish_env.model.frames import euler_from_quaternion
from fish_env.rigidbody.kinematics import euler_rates, rotations

CUTOFF_HZ, FINE_S = 5.0, 0.004
"""Usual low-pass of an inertial unit, and steps in which it is computed (s)."""
_LOW_PASS = butter(2, CUTOFF_HZ, fs=1.0 / FINE_S, output="sos")
_INDEX = {error.name: i for i, error in enumerate(SENSOR_ERRORS)}
_DEVICE = {
    **dict.fromkeys(("x", "y", "u", "v", "w"), "camera_delay"),
    **dict.fromkeys(("roll", "pitch", "yaw", "p", "q", "r"), "inertial_delay"),
    "z": "depth_delay",
}
_ROWS = {"velocity": [BY_NAME[n].index for n in "uvw"], "rate": [BY_NAME[n].index for n in "pqr"]}
_INERTIAL = ("roll", "pitch", "p", "q", "r")
"""Channels of which one at least says that there is an inertial unit. Without one a camera reads
the heading too."""
_ATTITUDE, _RATES, _PLACE = ("roll", "pitch", "yaw"), ("p", "q", "r"), ("x", "y", "z")
_CURVED = ("inertial_smoothing", *dict.fromkeys(_DEVICE.values()))
"""Errors whose change of the samples is not linear in them, or not in all of them together."""


def sensor_slopes(
    clock: FloatArray,
    filtered: Filtered,
    channels: Sequence[str],
    errors: FloatArray | None = None,
) -> FloatArray:
    """Change of every sample by every sensor error, at the filtered motion, shape (T, C, K).

    Args:
        clock: (T,) times of the samples (s).
        filtered: the run filtered, with its slopes.
        channels: names of its C channels.
        errors: (K,) where the slopes are taken; default: no errors.

    Raises:
        ValueError: the filter kept no slopes.
    """
    errors = np.zeros(len(SENSOR_ERRORS)) if errors is None else errors
    motion = _predicted(clock, filtered)
    return _by_errors(motion, channels, _late(clock, motion, channels, errors))


def _by_errors(motion: _Motion, channels: Sequence[str], delayed: Sequence[_Late]) -> FloatArray:
    """The slopes (T, C, K), those of late channels among them."""
    states, euler = motion.states, motion.euler
    rates = states[:, _ROWS["rate"]]
    place = states[:, :3] - states[0, :3]
    found = np.zeros((len(euler), len(channels), len(SENSOR_ERRORS)))
    at = {name: i for i, name in enumerate(channels)}
    for late in delayed:
        _put(found, at, late.name, late.delay, late.by_delay)
        if late.by_smoothing is not None:
            _put(found, at, late.name, "inertial_smoothing", late.by_smoothing)
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
    depth = place[:, 2]
    _put(found, at, "x", "camera_pitch", depth)
    _put(found, at, "y", "camera_roll", -depth)
    for j, name in enumerate(("x", "y")):
        _put(found, at, name, "camera_scale_per_depth", -place[:, j] * depth)
    found[:, :, [_INDEX[name] for name in _absent(channels)]] = 0.0
    return found


def sensor_distortion(
    clock: FloatArray, filtered: Filtered, channels: Sequence[str], errors: FloatArray
) -> FloatArray:
    """What sensor errors do to every sample, at the filtered motion, shape (T, C).

    All are linear in it but delays: of a signal that is late by a tenth of its period, its slope
    with time tells only four fifths.

    Args:
        clock: (T,) times of the samples (s).
        filtered: the run filtered, with its slopes.
        channels: names of its C channels.
        errors: (K,) of the sensors.

    Raises:
        ValueError: the filter kept no slopes.
    """
    linear = errors.copy()
    linear[[_INDEX[name] for name in _CURVED]] = 0.0
    motion, absent = _predicted(clock, filtered), _absent(channels)
    delayed = _late(clock, motion, channels, errors)
    found = np.asarray(_by_errors(motion, channels, delayed) @ linear)
    at = {name: i for i, name in enumerate(channels)}
    for late in delayed:
        if late.delay not in absent:
            found[:, at[late.name]] += late.change
    return found


@dataclass(frozen=True, eq=False)
class _Late:
    """A channel that a device smooths and passes on late.

    Attributes:
        name: the channel.
        delay: the error that says how late.
        change: (T,) of its samples.
        by_delay: (T,) slope of that.
        by_smoothing: (T,) likewise; None where the device smooths nothing.
    """

    name: str
    delay: str
    change: FloatArray
    by_delay: FloatArray
    by_smoothing: FloatArray | None = None


def _late(
    clock: FloatArray, motion: _Motion, channels: Sequence[str], errors: FloatArray
) -> list[_Late]:
    """Every channel with what its device's filter and delay do to it.

    What a delay does is the integral of the predicted rate of change: the channel itself jumps at
    each sample by what that corrects.
    """
    inertial = _has_inertial_unit(channels)
    device = _DEVICE if inertial else {**_DEVICE, "yaw": "camera_delay"}
    size, found = errors[_INDEX["inertial_smoothing"]], []
    for name in channels:
        if name not in device:
            continue
        seen = np.maximum(clock - float(errors[_INDEX[device[name]]]), clock[0])
        rate = make_interp_spline(clock, motion.change[name], k=1)
        path = rate.antiderivative()
        change, by_delay, by_smoothing = path(seen) - path(clock), -rate(seen), None
        if inertial and name in (*_ATTITUDE, *_RATES):
            taken = _taken(clock, motion.of(name), motion.change[name])
            by_smoothing = taken(seen)
            change, by_delay = change + size * by_smoothing, by_delay - size * taken(seen, nu=1)
        found.append(_Late(name, device[name], change, by_delay, by_smoothing))
    return found


def _has_inertial_unit(channels: Sequence[str]) -> bool:
    return not set(_INERTIAL).isdisjoint(channels)


def _absent(channels: Sequence[str]) -> list[str]:
    """Sensor errors of devices that these channels do not come from, or that none of them sees."""
    absent: tuple[str, ...] = ()
    if not _has_inertial_unit(channels):
        absent += ("mounting_", "compass_", "gyro_", "inertial_")
    if "z" not in channels:
        absent += ("camera_roll", "camera_pitch", "camera_scale_per_depth")
    return [name for name in _INDEX if name.startswith(absent)] if absent else []


def _taken(clock: FloatArray, values: FloatArray, rate: FloatArray) -> BSpline:
    """What an inertial unit's filter takes from samples (T,), settled on the first of them.

    The delay of such a filter is a good part of a beat: no slope with time says what it does.
    Between two samples the channel follows from both and its rates there, and from none after: with
    that the regressor would follow its innovation. Straight lines would take a fiftieth off a beat
    of 2 Hz seen at 25 Hz.
    """
    even = np.arange(clock[0], clock[-1] + FINE_S, FINE_S)
    path = CubicHermiteSpline(clock, values, rate)(np.minimum(even, clock[-1]))
    filtered = np.asarray(sosfilt(_LOW_PASS, path - values[0])) + values[0]
    return make_interp_spline(even, filtered - path, k=1)


@dataclass(frozen=True, eq=False)
class _Motion:
    """A run as predicted, one sample ahead.

    Attributes:
        states: (T, states).
        euler: (T, 3) angles.
        change: rate of change (T,) of each channel.
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
    step = np.maximum(np.diff(clock, prepend=clock[0] - 1.0), 1e-9)
    change: dict[str, FloatArray] = {}
    for names, block in (("uvw", "velocity"), ("pqr", "rate")):
        rows = _ROWS[block]
        before = np.vstack([states[:1, rows], filtered.states[:-1, rows]])
        speeds: FloatArray = ((states[:, rows] - before) / step[:, None]).T
        change |= dict(zip(names, speeds, strict=True))
    drift = np.einsum("tij,tj->ti", rotations(euler), states[:, _ROWS["velocity"]])
    turn = np.einsum("tij,tj->ti", kinematics, states[:, _ROWS["rate"]])
    change |= dict(zip(_PLACE, drift.T, strict=True)) | dict(zip(_ATTITUDE, turn.T, strict=True))
    if not all(np.isfinite(rate).all() for rate in change.values()):
        raise np.linalg.LinAlgError("the simulation diverges, and shows no sensor errors")
    return _Motion(states, euler, change)


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
            sensor_slopes(run.clock, one, channels, run.sensor_errors),
        )
        for run, one in zip(runs, filtered, strict=True)
    ]  # fmt: skip
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
