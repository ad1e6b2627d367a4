"""What imperfect sensors show of the hidden motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

Effects = Mapping[str, Mapping[str, float]]
ANGLES = ("roll", "pitch", "yaw")
ALL_CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r")
CAMERA_CHANNELS = ("x", "y", "z", "yaw")


def clock(effects: Effects) -> float:
    """True time per time of the log's clock, which stamps the commands."""
    return effects.get("clock_scale", {}).get("scale", 1.0)


def true_times(recorded: np.ndarray, effects: Effects) -> np.ndarray:
    """When the state that a record shows really was: its clocks and its delay."""
    scale = clock(effects) * effects.get("clock_skew", {}).get("scale", 1.0)
    delay = effects.get("sensor_delay", {}).get("delay", 0.0)
    return np.asarray(recorded) * scale - delay


def channels_of(states: np.ndarray) -> dict[str, np.ndarray]:
    """True channels of states, (T, STATES); the yaw winds on."""
    r = states[:, 3:12].reshape(-1, 3, 3)
    yaw = np.arctan2(r[:, 1, 0], r[:, 0, 0])
    return {
        "x": states[:, 0],
        "y": states[:, 1],
        "z": states[:, 2],
        "roll": np.arctan2(r[:, 2, 1], r[:, 2, 2]),
        "pitch": -np.arcsin(np.clip(r[:, 2, 0], -1.0, 1.0)),
        "yaw": np.unwrap(yaw),
        "u": states[:, 12],
        "v": states[:, 13],
        "w": states[:, 14],
        "p": states[:, 15],
        "q": states[:, 16],
        "r": states[:, 17],
    }


def distorted(channels: Mapping[str, np.ndarray], effects: Effects) -> dict[str, np.ndarray]:
    """The channels as biased sensors give them, without noise."""
    measured = dict(channels)
    for name in ("x", "y", "z"):
        measured[name] = measured[name] * effects.get("position_scale", {}).get("scale", 1.0)
    measured["z"] = measured["z"] + effects.get("depth_bias", {}).get("offset", 0.0)
    askew = effects.get("attitude_misalignment")
    if askew:
        measured |= in_sensor_axes(measured, [askew[name] for name in ANGLES])
    for name, bias in effects.get("gyro_bias", {}).items():
        measured[name] = measured[name] + bias
    return measured


def in_sensor_axes(channels: Mapping[str, np.ndarray], euler: list[float]) -> dict[str, np.ndarray]:
    """Angles and rates of a sensor that is turned in the hull by these angles."""
    mounted = Rotation.from_euler("xyz", euler)
    body = Rotation.from_euler("xyz", np.column_stack([channels[name] for name in ANGLES]))
    seen = (body * mounted).as_euler("xyz")
    yaw = channels["yaw"] + np.angle(np.exp(1j * (seen[:, 2] - channels["yaw"])))
    rates = mounted.inv().apply(np.column_stack([channels[name] for name in "pqr"]))
    return {
        "roll": seen[:, 0],
        "pitch": seen[:, 1],
        "yaw": yaw,
        **dict(zip("pqr", rates.T, strict=True)),
    }
