"""What imperfect sensors show of the hidden motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

Effects = Mapping[str, Mapping[str, float]]
ALL_CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r")
CAMERA_CHANNELS = ("x", "y", "z", "yaw")


def true_times(recorded: np.ndarray, effects: Effects) -> np.ndarray:
    """When the state that a record shows really was: its clock and its delay."""
    scale = effects.get("clock_scale", {}).get("scale", 1.0)
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
    for effect in ("attitude_misalignment", "gyro_bias"):
        for name, bias in effects.get(effect, {}).items():
            measured[name] = measured[name] + bias
    return measured
