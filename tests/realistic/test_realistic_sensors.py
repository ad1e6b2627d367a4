"""Sensors of the realistic suite do what they declare."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.hidden.motion import STATES
from tests.hidden.realistic import sensors


def noise_of(values, count=60000, moving=None, seed=0):
    moving = np.ones(count, bool) if moving is None else moving
    clean = {"x": np.zeros(count), "p": np.zeros(count)}
    rng = np.random.default_rng(seed)
    return sensors.noisy(clean, {"x": 0.002, "p": 0.01}, moving, values, rng)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01])
def test_outliers_have_the_declared_share_and_size(share):
    seen = noise_of({"outliers": {"share": share, "size": 20.0}})
    for name, sd in (("x", 0.002), ("p", 0.01)):
        wild = np.abs(seen[name]) > 8.0 * sd
        assert wild.mean() == pytest.approx(share, rel=0.3, abs=1e-5)
        if share:
            assert np.median(np.abs(seen[name][wild])) == pytest.approx(20.0 * sd, rel=0.05)


def test_quantised_channels_have_steps():
    seen = noise_of({"quantisation": {"step": 1.5}})["x"]
    assert np.abs(seen / 0.003 - np.round(seen / 0.003)).max() < 1e-9
    assert np.isfinite(seen).all()


def test_dropouts_come_in_bursts_of_one_device():
    seen = noise_of({"dropouts": {"share": 0.05, "length": 10.0}})
    gone = np.isnan(seen["x"])
    assert gone.mean() == pytest.approx(0.05, rel=0.15)
    starts = np.sum(gone[1:] & ~gone[:-1])
    assert gone.sum() / starts == pytest.approx(10.0, rel=0.15)
    assert not np.array_equal(gone, np.isnan(seen["p"]))
    assert not gone[[0, -1]].any()


def test_noise_is_larger_in_motion_than_in_quiet_stretches():
    moving = np.arange(60000) >= 30000
    seen = noise_of({"moving_noise": {"factor": 3.0}}, moving=moving)["x"]
    assert seen[~moving].std() == pytest.approx(0.002, rel=0.03)
    assert seen[moving].std() == pytest.approx(0.006, rel=0.03)


def swaying(frequency=2.0):
    """A motion whose channels are sines, level, at constant depth."""
    times = np.arange(5001) * sensors.STEP
    states = np.zeros((len(times), STATES))
    yaw = 0.3 * np.sin(2 * np.pi * frequency * times)
    states[:, 0], states[:, 2] = 0.1 * times, 0.5
    states[:, 3], states[:, 4], states[:, 6], states[:, 7] = (
        np.cos(yaw), -np.sin(yaw), np.sin(yaw), np.cos(yaw),
    )  # fmt: skip
    states[:, 11] = 1.0
    states[:, 17] = np.gradient(yaw, times)
    return sensors.Motion(times, states)


def gain_of(channel, reference, motion, frequency):
    wave = np.exp(-2j * np.pi * frequency * motion.times)
    late = slice(2500, 5000)
    return np.sum((channel * wave)[late]) / np.sum((reference * wave)[late])


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0])
def test_the_imu_filter_halves_the_power_at_its_cutoff(frequency):
    motion = swaying(frequency)
    plain = sensors.systematic(motion, {})
    seen = sensors.systematic(motion, {"imu_lowpass": {"cutoff": 5.0}})
    gain = gain_of(seen["r"], plain["r"], motion, frequency)
    warped = math.tan(math.pi * frequency * 0.004) / math.tan(math.pi * 5.0 * 0.004)
    assert abs(gain) == pytest.approx(1.0 / math.sqrt(1.0 + warped**4), rel=0.02)
    assert np.angle(gain) < 0.0
    assert np.array_equal(seen["x"], plain["x"])


def test_each_device_is_late_by_its_own_time():
    motion = swaying()
    values = {
        "sensor_delay": {"camera": 0.10, "imu": 0.02, "depth": 0.0},
        "clock_offset": {"offset": 0.05},
    }
    when = np.linspace(2.0, 18.0, 200)
    seen = sensors.sampled(motion, sensors.systematic(motion, values), when, values)
    assert np.allclose(seen["x"], 0.1 * (when - 0.15))
    yaw = 0.3 * np.sin(2 * np.pi * 2.0 * (when - 0.02))
    assert np.abs(seen["yaw"] - yaw).max() < 2e-4


def test_a_marker_beside_the_origin_swings_with_the_hull():
    motion = swaying()
    plain = sensors.systematic(motion, {})
    seen = sensors.systematic(motion, {"marker_offset": {"x": 0.1, "y": 0.0, "z": 0.0}})
    assert np.allclose(seen["x"] - plain["x"], 0.1 * np.cos(plain["yaw"]))
    assert np.allclose(seen["y"] - plain["y"], 0.1 * np.sin(plain["yaw"]))
    assert np.array_equal(seen["z"], plain["z"])


def test_a_unit_that_is_askew_turns_rates_and_attitude():
    motion = swaying()
    angle = 0.2
    askew = {"roll": angle, "pitch": 0.0, "yaw": 0.0}
    plain = sensors.systematic(motion, {})
    seen = sensors.systematic(motion, {"attitude_misalignment": askew})
    assert np.allclose(seen["roll"], angle)
    assert np.allclose(seen["q"], math.sin(angle) * plain["r"])
    assert np.allclose(seen["r"], math.cos(angle) * plain["r"])


def test_gyro_camera_water_and_iron_distort_as_declared():
    motion = swaying()
    plain = sensors.systematic(motion, {})
    scaled = sensors.systematic(motion, {"gyro_scale": {"p": 1.0, "q": 1.0, "r": 0.9}})
    assert np.allclose(scaled["r"], 0.9 * plain["r"])
    tilted = sensors.systematic(motion, {"camera_tilt": {"roll": 0.0, "pitch": 0.1}})
    assert np.allclose(tilted["x"], math.cos(0.1) * plain["x"] - math.sin(0.1) * 0.5)
    motion.states[:, 2] = 1.5
    deep = sensors.systematic(motion, {"refraction": {"height": 2.0}})
    assert np.allclose(deep["x"], plain["x"] * (2.0 + 0.5 / 1.333) / (2.0 + 1.5 / 1.333))
    bent = sensors.systematic(motion, {"soft_iron": {"amplitude": 0.1, "angle": 0.0}})
    assert np.allclose(bent["yaw"] - plain["yaw"], 0.1 * np.sin(2 * plain["yaw"]))


def test_derived_channels_are_those_of_the_path():
    motion = swaying(0.5)
    stamps = motion.times[::10]
    seen = {name: channel[::10] for name, channel in sensors.systematic(motion, {}).items()}
    out = sensors.derived(seen, stamps)
    assert np.allclose(out["u"][5:-5], 0.1 * np.cos(seen["yaw"][5:-5]), atol=1e-3)
    assert np.allclose(out["r"][5:-5], seen["r"][5:-5], atol=0.02)
