"""The state in which a run begins, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Run
from fish_env.identification.state_blocks import N_ERROR, PHASE_COLUMN, columns
from fish_env.model.frames import quaternion_from_euler
from fish_env.model.state import BASE_STATES
from fish_env.sensing.channels import channels_from_states
from fish_env.sensing.geometry import ANGLES, Geometry, through_geometry

VELOCITY, RATE = columns("velocity"), columns("rate")
POSITIONS = {"x": 0, "y": 1, "z": 2}
CORRECTIONS = 4
"""Each leaves a tenth or less of the error of a start."""


def first_state(
    run: Run,
    channels: Sequence[str],
    measured: FloatArray,
    clock: FloatArray,
    noise_sd: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Initial state and its spread: level and at rest, or a local line through the first samples.

    At rest the first measured pose is off by the sensor noise only; the velocities have the spread
    that a first stroke gives in a tenth of a second. An unknown start takes value
    and slope of each channel over the first 0.6 s; a channel that is not measured starts at zero
    with a spread that covers a swimming fish.
    """
    rest = run.start == "rest"
    first = {name: _start_of(measured[:, i], clock) for i, name in enumerate(channels)}
    noise = dict(zip(channels, noise_sd, strict=True))
    pose = {n: first.get(n, (0.0, 0.0))[0] for n in ("x", "y", "z", "roll", "pitch", "yaw")}
    if rest:
        pose["roll"] = pose["pitch"] = 0.0
    state = np.zeros(len(BASE_STATES))
    state[0:3] = pose["x"], pose["y"], pose["z"]
    euler = np.array([pose["roll"], pose["pitch"], pose["yaw"]])
    state[3:7] = quaternion_from_euler(euler)
    state[13] = run.tail_phase or 0.0
    spread = np.zeros(N_ERROR)
    wide = {"x": 1e-3, "y": 1e-3, "z": 1e-3, "roll": 0.05, "pitch": 0.1, "yaw": 1e-3}
    for i, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
        spread[i] = 2.0 * noise.get(name, wide[name])
    if rest:
        spread[3:5] = np.minimum(spread[3:5], 0.02)
        spread[VELOCITY], spread[RATE] = 0.02, 0.2
    else:
        ground = np.array([first.get(n, (0.0, 0.0))[1] for n in ("x", "y", "z")])
        state[7:10] = _into_body(euler, ground)
        spread[VELOCITY], spread[RATE] = 0.05, 0.6
    spread[PHASE_COLUMN] = 0.0 if run.tail_phase is not None else 0.4
    return state, np.diag(spread**2)


def told_at_start(swimming: bool) -> tuple[str, ...]:
    """Channels of which a run begins with what its first samples show: level, where at rest."""
    return (*POSITIONS, *ANGLES) if swimming else (*POSITIONS, "yaw")


def undo_geometry(states: FloatArray, geometry: Geometry, names: Sequence[str]) -> None:
    """Turn place and attitude that sensors of a geometry show into true ones, in place.

    Args:
        states: (states, N) as shown.
        geometry: of the sensors.
        names: channels that are shown.
    """
    told = channels_from_states(states.copy())
    angles = [name for name in names if name not in POSITIONS]
    for _ in range(CORRECTIONS):
        true = channels_from_states(states)
        seen = through_geometry(true, geometry)
        for name in names:
            if name in POSITIONS:
                states[POSITIONS[name]] += told[name] - seen[name]
        if angles:
            closer = [true[n] + (told[n] - seen[n]) * (n in angles) for n in ANGLES]
            states[3:7] = quaternion_from_euler(np.array(closer).T).T


def _start_of(values: FloatArray, clock: FloatArray) -> tuple[float, float]:
    """Value at the first sample and slope of a line through the first 0.6 s."""
    chosen = (clock <= 0.6) & np.isfinite(values)
    if chosen.sum() < 3:
        chosen = np.isfinite(values)
        chosen &= np.cumsum(chosen) <= 3
    if chosen.sum() < 2:
        return float(np.nanmean(values)), 0.0
    slope, level = np.polyfit(clock[chosen], np.unwrap(values[chosen]), 1)
    return float(level), float(slope)


def _into_body(euler: FloatArray, inertial: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    result: FloatArray = Rotation.from_euler("ZYX", euler[::-1]).inv().apply(inertial)
    return result
