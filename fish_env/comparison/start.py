"""Where a measured run starts: the initial state for its simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from fish_env.arrays import BoolArray, FloatArray
from fish_env.comparison.errors import WINDING
from fish_env.data import Run, unwrap_angle
from fish_env.effects.extended import ExtendedModel
from fish_env.model.state import INPUTS
from fish_env.sensing import measured_channels
from fish_env.simulator import InitialState

FEWEST_SAMPLES = 5
FITTED_BEATS = 2
POSE = ("x", "y", "z", "roll", "pitch", "yaw")
_CORRECTIONS = 5


def first_beat_s(run: Run) -> float:
    """Length of the first tail beat, s; 1 s where the tail is still."""
    frequency = run.commands.values[0, INPUTS.index("tail_frequency")]
    return float(1.0 / frequency) if frequency > 0.0 else 1.0


def opening(run: Run, beats: int = 1) -> BoolArray:
    """Which samples lie in the first tail beats, shape (n,); at least the first five."""
    inside = run.time_s <= run.time_s[0] + beats * first_beat_s(run)
    inside[:FEWEST_SAMPLES] = True
    return np.asarray(inside)


def measured_start(run: Run, model: ExtendedModel) -> tuple[InitialState, str]:
    """Initial state of a run, and in words where it comes from.

    The pose is the first sample of each channel, 0 where there is none, with the model's effects
    on measurement undone. A run from rest is level and still. Otherwise velocities that were
    measured are taken from their first samples, and the others are slopes of position and attitude
    over the first two tail beats, where a straight line and the beat's own sine and cosine are
    fitted together: a line alone would mostly show the tail.
    """
    pose = _true_pose(model, {name: _first(run, name) for name in POSE})
    if run.start == "rest":
        level = pose | {"roll": 0.0, "pitch": 0.0}
        return _state(level), "at rest and level at the first measured position"
    start = replace(
        _state(pose),
        velocity_body=_velocity(run, pose),
        angular_velocity_body=_angular_velocity(run, pose),
    )
    return start, "pose from the first samples, velocities from the first two tail beats"


def _first(run: Run, name: str) -> float:
    values = run.channels.get(name, np.zeros(1))
    return float(values[np.isfinite(values)][0])


def _state(pose: dict[str, float]) -> InitialState:
    x, y, z, roll, pitch, yaw = (pose[name] for name in POSE)
    return InitialState(position=(x, y, z), euler=(roll, pitch, yaw))


def _true_pose(model: ExtendedModel, measured: dict[str, float]) -> dict[str, float]:
    """The pose that the model's sensors would report as this one."""
    if not model.measurement:
        return measured
    pose = dict(measured)
    for _ in range(_CORRECTIONS):  # converges for biases and for scales near 1
        channels = {name: np.full(1, value) for name, value in pose.items()}
        still = {name: np.zeros(1) for name in ("u", "v", "w", "p", "q", "r")}
        seen = measured_channels(model, channels | still)
        pose = {name: pose[name] + measured[name] - float(seen[name][0]) for name in POSE}
    return pose


def _slope(run: Run, name: str) -> float:
    """Slope over the first beats, 0 where too little was measured."""
    if name not in run.channels:
        return 0.0
    values = _continuous(run, name)
    used = opening(run, FITTED_BEATS) & np.isfinite(values)
    if used.sum() < FEWEST_SAMPLES:
        return 0.0
    time = run.time_s[used] - run.time_s[0]
    phase = 2.0 * np.pi * time / first_beat_s(run)
    basis = np.column_stack([time, np.ones_like(time), np.sin(phase), np.cos(phase)])
    return float(np.linalg.lstsq(basis, values[used], rcond=None)[0][0])


def _continuous(run: Run, name: str) -> FloatArray:
    values = run.channels[name]
    return unwrap_angle(values) if name in WINDING else values


def _mean(run: Run, name: str, otherwise: float) -> float:
    if name not in run.channels:
        return otherwise
    values = _continuous(run, name)[opening(run, FITTED_BEATS)]
    return float(np.nanmean(values)) if np.isfinite(values).any() else otherwise


def _velocity(run: Run, pose: dict[str, float]) -> tuple[float, float, float]:
    """Velocity in the body frame, m/s; slopes belong to the beats' mean attitude."""
    angles = [_mean(run, name, pose[name]) for name in ("yaw", "pitch", "roll")]
    slopes = [_slope(run, name) for name in "xyz"]
    u, v, w = Rotation.from_euler("ZYX", angles).apply(slopes, inverse=True)
    given = {name: _first(run, name) for name in "uvw" if name in run.channels}
    return given.get("u", float(u)), given.get("v", float(v)), given.get("w", float(w))


def _angular_velocity(run: Run, pose: dict[str, float]) -> tuple[float, float, float]:
    """Angular velocity in the body frame, rad/s, from the rates of the Euler angles."""
    roll, pitch = pose["roll"], pose["pitch"]
    roll_rate, pitch_rate, yaw_rate = (_slope(run, name) for name in ("roll", "pitch", "yaw"))
    p = roll_rate - yaw_rate * np.sin(pitch)
    q = pitch_rate * np.cos(roll) + yaw_rate * np.cos(pitch) * np.sin(roll)
    r = -pitch_rate * np.sin(roll) + yaw_rate * np.cos(pitch) * np.cos(roll)
    given = {name: _first(run, name) for name in "pqr" if name in run.channels}
    return given.get("p", float(p)), given.get("q", float(q)), given.get("r", float(r))
