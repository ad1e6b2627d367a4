"""Averages over one tail beat, as a recorder would derive them from what it measures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Measurement
from fish_env.sensing import channels_from_states
from fish_env.sensing.geometry import ANGLES, through_geometry

SENSED = ("x", "y", "z", "roll", "pitch", "yaw")
"""Channels that the averages are derived from, in the order of the measurement's rows."""
MEANS = ("surge_speed", "sway_speed", "heave_speed", "speed", "yaw_rate", "curvature", "pitch")
"""Averages, in the order of their rows."""


def beat_means(
    samples: FloatArray, period: float, measurement: Measurement, lanes: npt.NDArray[np.intp]
) -> FloatArray:
    """Averages of n fish over the beat that the samples span.

    Args:
        samples: states, shape (samples, rows, n), evenly spaced, the first a beat before the last.
        period: of the beat, s of true time.
        measurement: what sensors and recorder do; rows as `SENSED`. Of the geometry, how the
            attitude sensor is mounted; a camera's geometry does not enter averages.
        lanes: which of the measurement's fish these are, shape (n,).

    Returns:
        Shape (7, n), in the order of :data:`MEANS`: speeds m/s, yaw rate rad/s, curvature of the
        path 1/m, pitch rad, as :func:`fish_env.steady.steady_motion` defines them.
    """
    channels = channels_from_states(np.moveaxis(samples, 1, 0))
    gain = {name: measurement.gain[i, lanes] for i, name in enumerate(SENSED)}
    bias = {name: measurement.bias[i, lanes] for i, name in enumerate(SENSED)}
    pace = measurement.pace[lanes]
    attitude = {name: channels[name] for name in ANGLES}
    mounted = through_geometry(attitude, measurement.take(lanes).geometry)
    angles = {name: mounted[name][1:] * gain[name] + bias[name] for name in ANGLES}
    body = np.stack([channels[name][1:] for name in "uvw"])
    true = to_inertial({n: channels[n][1:] for n in angles}, body)
    seen = true * np.stack([gain[name] for name in "xyz"])[:, None] * pace
    surge, sway, heave = to_body(angles, seen).mean(axis=1)
    yaw_rate = gain["yaw"] * (channels["yaw"][-1] - channels["yaw"][0]) / period * pace
    elapsed = np.linspace(0.0, period, len(samples))[1:, None] / pace
    turned = np.exp(-1j * yaw_rate * elapsed)
    path = np.abs(((seen[0] + 1j * seen[1]) * turned).mean(axis=0))
    speed = np.hypot(path, seen[2].mean(axis=0))
    curvature = np.abs(yaw_rate) / np.maximum(path, 1e-6)
    pitch = angles["pitch"].mean(axis=0)
    return np.stack([surge, sway, heave, speed, yaw_rate, curvature, pitch])


def to_inertial(angles: dict[str, FloatArray], vector: FloatArray) -> FloatArray:
    """Vectors along the body's axes as inertial ones, both (3, samples, n)."""
    x, y, z = vector
    y, z = _turned(y, z, angles["roll"])
    z, x = _turned(z, x, angles["pitch"])
    x, y = _turned(x, y, angles["yaw"])
    return np.stack([x, y, z])


def to_body(angles: dict[str, FloatArray], vector: FloatArray) -> FloatArray:
    """Inertial vectors along the body's axes, both (3, samples, n)."""
    x, y, z = vector
    x, y = _turned(x, y, -angles["yaw"])
    z, x = _turned(z, x, -angles["pitch"])
    y, z = _turned(y, z, -angles["roll"])
    return np.stack([x, y, z])


def _turned(first: FloatArray, second: FloatArray, angle: FloatArray) -> tuple[FloatArray, ...]:
    """Components of a vector turned from the first axis towards the second."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * first - sine * second, sine * first + cosine * second
