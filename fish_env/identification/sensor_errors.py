"""What mounting and calibration of sensors leave, as small errors that every record may have.

A marker sits beside the origin, an inertial unit is screwed on a little askew, a compass bends with
the heading, a camera looks down at an angle and into water. Each is linear in one number, with
regressors that follow from the filtered motion. So no fish has to swim again to see what it does:
the filter's own slopes carry a change of the measurements through to its innovations. Errors that
are known are part of what the filter's sensors show, but for a few that a state cannot tell: these
are taken off the samples, and the regressors are then those of the corrected motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.first_state import told_at_start
from fish_env.identification.predicted_motion import Motion, predicted_motion, slopes_of
from fish_env.identification.runs import RunData
from fish_env.identification.state_blocks import N_ERROR, N_MOVING, columns
from fish_env.identification.variation import IN_SAMPLES, SENSOR_ERRORS
from fish_env.identification.variation_slopes import leave_diverged
from fish_env.model.frames import euler_from_quaternion
from fish_env.rigidbody.kinematics import euler_rates, rotations
from fish_env.sensing.devices import devices_of, has_inertial_unit
from fish_env.sensing.geometry import ANGLES, CALIBRATED_DEPTH, PLACE, RATES

USUAL_CUTOFF_HZ = 5.0
"""Usual low-pass of an inertial unit."""
_KNOWN: WeakKeyDictionary[Filtered, tuple[tuple[str | float, ...], FloatArray]]
_KNOWN = WeakKeyDictionary()
_INDEX = {error.name: i for i, error in enumerate(SENSOR_ERRORS)}


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
    motion = predicted_motion(clock, filtered)
    found = np.zeros((len(clock), len(channels), len(SENSOR_ERRORS)))
    devices = np.array(devices_of(channels))
    for device in np.unique(devices).tolist():
        age = 0.0 if ages is None else float(ages[device])
        at = {channels[i]: i for i in np.flatnonzero(devices == device).tolist()}
        seen = motion.ago(age)
        _put_mounting(found, at, seen)
        _put_camera(found, at, seen)
        for name in at.keys() & {*ANGLES, *RATES}:
            _put(found, at, name, "inertial_smoothing", motion.filtered(name, age, USUAL_CUTOFF_HZ))
    found[:, :, [_INDEX[name] for name in _absent(channels)]] = 0.0
    return found


def _put_mounting(found: FloatArray, at: dict[str, int], motion: Motion) -> None:
    """What markers and an inertial unit show that sit aside or askew, or have another gain."""
    turns, kinematics = rotations(motion.euler), euler_rates(motion.euler)
    for k, axis in enumerate(PLACE):
        for j, name in enumerate(("x", "y")):
            _put(found, at, name, f"marker_{axis}", turns[:, j, k])
    for k, angle in enumerate(ANGLES):
        for j, name in enumerate(ANGLES):
            _put(found, at, name, f"mounting_{angle}", kinematics[:, j, k])
        swung = np.cross(motion.rates, np.eye(3)[k])
        for j, name in enumerate(RATES):
            _put(found, at, name, f"mounting_{angle}", swung[:, j])
    for j, name in enumerate(RATES):
        _put(found, at, name, f"gyro_gain_{name}", motion.rates[:, j])
    yaw = motion.euler[:, 2]
    for turn, label in ((1.0, ""), (2.0, "2_")):
        _put(found, at, "yaw", f"compass_sin_{label}yaw", np.sin(turn * yaw))
        _put(found, at, "yaw", f"compass_cos_{label}yaw", np.cos(turn * yaw))


def _put_camera(found: FloatArray, at: dict[str, int], motion: Motion) -> None:
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
    begun[columns("position")] = [told.get(name, none) for name in PLACE]
    euler = euler_from_quaternion(run.state0[3:7])[None]
    turned = np.array([told.get(name, none) for name in ANGLES])
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
    slopes = slopes_of(filtered)
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
