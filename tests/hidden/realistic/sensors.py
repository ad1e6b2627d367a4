"""What real sensors make of a motion: first what is systematic, then noise of every kind."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from tests.hidden.measurement import channels_of
from tests.hidden.simulate import rotation

STEP = 0.004
"""s. Grid of the true motion, straight between its points, and its longest step."""
GROUP = {
    **dict.fromkeys(("x", "y", "u", "v", "w"), "camera"),
    "z": "depth",
    **dict.fromkeys(("roll", "pitch", "yaw", "p", "q", "r"), "imu"),
}
"""Which device gives a channel."""
REFRACTION, CALIBRATED = 1.333, 0.5
"""Index of water, and m: the depth at which the camera's scale is right."""
RATES = ("p", "q", "r")
ANGLES = ("roll", "pitch", "yaw")
Channels = dict[str, np.ndarray]


@dataclass(frozen=True)
class Motion:
    """A true motion on an even grid of times from zero on."""

    times: np.ndarray
    states: np.ndarray


def systematic(motion: Motion, values: Mapping[str, Mapping[str, float]]) -> Channels:
    """Channels on the motion's grid as sensors without noise and delay give them."""
    seen = channels_of(motion.states)
    turns = motion.states[:, 3:12].reshape(-1, 3, 3)
    inertial_unit(seen, turns, values, float(motion.times[1] - motion.times[0]))
    camera(seen, turns, values)
    return seen


def inertial_unit(
    seen: Channels, turns: np.ndarray, values: Mapping[str, Mapping[str, float]], step: float
) -> None:
    """Mounting, scale, filter and zero of the inertial unit, and the iron about its compass."""
    askew = values.get("attitude_misalignment")
    if askew:
        mounted = rotation([askew[name] for name in ANGLES])
        seen.update(angles_of(turns @ mounted))
        rates = np.column_stack([seen[name] for name in RATES]) @ mounted
        seen.update(zip(RATES, rates.T, strict=True))
    iron = values.get("soft_iron")
    if iron:
        bent = iron["amplitude"] * np.sin(2.0 * seen["yaw"] + iron["angle"])
        seen["yaw"] = seen["yaw"] + bent
    for name, scale in values.get("gyro_scale", {}).items():
        seen[name] = seen[name] * scale
    cutoff = values.get("imu_lowpass", {}).get("cutoff", math.inf)
    if math.isfinite(cutoff):
        for name in (*ANGLES, *RATES):
            seen[name] = low_passed(seen[name], cutoff, step)
    for name, bias in values.get("gyro_bias", {}).items():
        seen[name] = seen[name] + bias


def angles_of(turns: np.ndarray) -> Channels:
    """Roll, pitch and yaw of rotation matrices (T, 3, 3); the yaw winds on."""
    return {
        "roll": np.arctan2(turns[:, 2, 1], turns[:, 2, 2]),
        "pitch": -np.arcsin(np.clip(turns[:, 2, 0], -1.0, 1.0)),
        "yaw": np.unwrap(np.arctan2(turns[:, 1, 0], turns[:, 0, 0])),
    }


def low_passed(channel: np.ndarray, cutoff: float, step: float) -> np.ndarray:
    """Second-order Butterworth filter that has settled on the first value.

    Args:
        channel: samples.
        cutoff: Hz.
        step: s between samples.
    """
    sections = butter(2, cutoff, fs=1.0 / step, output="sos")
    filtered, _ = sosfilt(sections, channel, zi=sosfilt_zi(sections) * channel[0])
    return np.asarray(filtered)


def camera(seen: Channels, turns: np.ndarray, values: Mapping[str, Mapping[str, float]]) -> None:
    """A marker beside the origin, a camera that is tilted, looks into water, or has a scale."""
    place = np.column_stack([seen[name] for name in "xyz"])
    marker = values.get("marker_offset")
    if marker:
        place = place + turns @ np.array([marker[name] for name in "xyz"])
    tilt = values.get("camera_tilt")
    if tilt:
        place = place @ rotation((tilt["roll"], tilt["pitch"], 0.0))
    height = values.get("refraction", {}).get("height", math.inf)
    if math.isfinite(height):
        depth = np.maximum(seen["z"], 0.0)
        place = (
            place * ((height + CALIBRATED / REFRACTION) / (height + depth / REFRACTION))[:, None]
        )
    scale = values.get("position_scale", {}).get("scale", 1.0)
    seen["x"], seen["y"] = place[:, 0] * scale, place[:, 1] * scale
    seen["z"] = seen["z"] * scale + values.get("depth_bias", {}).get("offset", 0.0)


def sampled(
    motion: Motion,
    seen: Channels,
    when: np.ndarray,
    values: Mapping[str, Mapping[str, float]],
    jitter: np.ndarray | float = 0.0,
) -> Channels:
    """Channels at samples whose true times are `when` (T,), each as late as its device.

    Args:
        motion: gives the grid.
        seen: channels on the grid.
        when: true times of the samples, s.
        values: parameters by effect.
        jitter: how much later than its stamp the camera's exposure is, s.
    """
    late = values.get("sensor_delay", {})
    offset = values.get("clock_offset", {}).get("offset", 0.0)
    shifts = {
        "camera": -late.get("camera", 0.0) - offset + jitter,
        "imu": -late.get("imu", 0.0),
        "depth": -late.get("depth", 0.0),
    }
    return {
        name: np.interp(when + shifts[GROUP[name]], motion.times, channel)
        for name, channel in seen.items()
        if name in GROUP
    }


def noisy(
    clean: Channels,
    noise: Mapping[str, float],
    moving: np.ndarray,
    values: Mapping[str, Mapping[str, float]],
    rng: np.random.Generator,
) -> Channels:
    """Channels with noise, outliers, steps and gaps.

    Args:
        clean: channels without noise.
        noise: one-sigma value of each measured channel in quiet stretches.
        moving: (T,) whether the robot moves, where noise may be larger.
        values: parameters by effect.
        rng: source of randomness.
    """
    factor = values.get("moving_noise", {}).get("factor", 1.0)
    outliers = values.get("outliers", {"share": 0.0, "size": 0.0})
    step = values.get("quantisation", {}).get("step", 0.0)
    out: Channels = {}
    for name, sd in noise.items():
        count = len(clean[name])
        values_now = clean[name] + sd * np.where(moving, factor, 1.0) * rng.standard_normal(count)
        wild = rng.random(count) < outliers["share"]
        size = sd * outliers["size"] * rng.choice([-1.0, 1.0], count)
        values_now = np.where(wild, values_now + size, values_now)
        out[name] = np.round(values_now / (step * sd)) * step * sd if step else values_now
    lost = values.get("dropouts")
    if lost:
        for device in ("camera", "imu", "depth"):
            gone = bursts(len(moving), lost["share"], lost["length"], rng)
            for name in out:
                if GROUP[name] == device:
                    out[name] = np.where(gone, np.nan, out[name])
    return out


def bursts(count: int, share: float, length: float, rng: np.random.Generator) -> np.ndarray:
    """Which samples are lost, in bursts of a mean length; never the first or the last."""
    lost = np.zeros(count, bool)
    begins = np.flatnonzero(rng.random(count) < share / length)
    for begin in begins:
        lost[begin : begin + int(rng.geometric(1.0 / length))] = True
    lost[[0, -1]] = False
    return lost


def derived(measured: Channels, stamps: np.ndarray) -> Channels:
    """The channels with u, v and r computed from x, y and yaw over two samples either side."""

    def slope(channel: np.ndarray) -> np.ndarray:
        out = np.gradient(channel, stamps)
        out[2:-2] = (channel[4:] - channel[:-4]) / (stamps[4:] - stamps[:-4])
        return out

    vx, vy = slope(measured["x"]), slope(measured["y"])
    c, s = np.cos(measured["yaw"]), np.sin(measured["yaw"])
    return measured | {"u": c * vx + s * vy, "v": c * vy - s * vx, "r": slope(measured["yaw"])}
