"""Delays, biases and scales of what is recorded."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from scipy.spatial.transform import Rotation

from fish_env.comparison.runs import simulate_run
from fish_env.data import CommandSteps, Run
from fish_env.effects.extended import build_model
from fish_env.sensing import measured_channels, true_times
from fish_env.sensing.measurement import ages_s
from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import swimmer

ANGLES = ("roll", "pitch", "yaw")
CHANNELS = {
    name: np.array([0.1, -0.2, 0.3]) + i
    for i, name in enumerate(
        ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r", "tail_angle")
    )
}


def measured(effects, channels=CHANNELS):
    return measured_channels(build_model(swimmer(), effects), channels)


def changes(effects):
    """Channels that an effect changes, with the difference."""
    return {
        name: values - CHANNELS[name]
        for name, values in measured(effects).items()
        if not np.array_equal(values, CHANNELS[name])
    }


@pytest.mark.parametrize(
    ("name", "added"),
    [
        ("gyro_bias", {"p": 0.01, "q": -0.02, "r": 0.005}),
    ],
)
def test_a_bias_is_added_to_its_channels_and_no_others(name, added):
    shifted = changes({name: added})
    assert set(shifted) == set(added)
    for channel, value in added.items():
        np.testing.assert_allclose(shifted[channel], value, atol=1e-15)


def test_a_depth_bias_is_added_to_the_depth_alone():
    shifted = changes({"depth_bias": {"offset": 0.07}})
    assert set(shifted) == {"z"}
    np.testing.assert_allclose(shifted["z"], 0.07, atol=1e-15)


def test_a_position_scale_multiplies_all_of_the_position():
    """And no speed: which is how it can be told."""
    scaled = measured({"position_scale": {"scale": 1.04}})
    for name in CHANNELS:
        factor = 1.04 if name in ("x", "y", "z") else 1.0
        np.testing.assert_allclose(scaled[name], factor * CHANNELS[name], rtol=1e-15)


def turn(angles):
    """Body to inertial, one matrix for each sample."""
    return Rotation.from_euler("xyz", np.column_stack(angles))


def rows(channels, names):
    return np.column_stack([channels[name] for name in names])


def test_a_sensor_mounted_askew_shows_its_own_attitude_and_rates():
    """R M and M^T omega; position and speed are not its business."""
    askew = {"roll": 0.05, "pitch": -0.04, "yaw": 0.07}
    seen = measured({"attitude_misalignment": askew})
    mount = turn([[angle] for angle in askew.values()])
    body = turn([CHANNELS[name] for name in ANGLES])
    shown = turn([seen[name] for name in ANGLES])
    np.testing.assert_allclose(shown.as_matrix(), (body * mount).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rows(seen, "pqr"), mount.inv().apply(rows(CHANNELS, "pqr")))
    for name in ("x", "y", "z", "u", "v", "w"):
        assert seen[name] is CHANNELS[name]


def test_a_level_fish_shows_the_angles_of_the_mounting_themselves():
    level = {name: np.zeros(1) for name in CHANNELS} | {"yaw": np.full(1, 9.0)}
    seen = measured({"attitude_misalignment": {"roll": 0.05, "pitch": -0.04, "yaw": 0.07}}, level)
    assert [float(seen[name][0]) for name in ANGLES] == pytest.approx([0.05, -0.04, 9.07])


def test_a_marker_beside_the_origin_swings_with_the_attitude():
    """C_I + R r in x and y; the depth comes from another sensor."""
    seen = measured({"marker_offset": {"x": 0.06, "y": 0.03, "z": -0.08}})
    place = rows(CHANNELS, "xyz") + turn([CHANNELS[n] for n in ANGLES]).apply([0.06, 0.03, -0.08])
    np.testing.assert_allclose(rows(seen, "xy"), place[:, :2], atol=1e-12)
    np.testing.assert_array_equal(seen["z"], CHANNELS["z"])


def test_a_tilted_camera_sees_depth_as_distance():
    """T^T C_I: a pitch by a looks x cos a - z sin a."""
    seen = measured({"camera_tilt": {"pitch": 0.07}})
    expected = CHANNELS["x"] * np.cos(0.07) - CHANNELS["z"] * np.sin(0.07)
    np.testing.assert_allclose(seen["x"], expected, atol=1e-12)
    np.testing.assert_allclose(seen["y"], CHANNELS["y"], atol=1e-12)


def test_refraction_shrinks_what_is_deep():
    """(h + d0/n) / (h + z/n): right at d0 = 0.5 m, smaller below, larger above."""
    depth = {"x": np.ones(3), "y": -np.ones(3), "z": np.array([0.0, 0.5, 2.0])}
    seen = measured({"refraction": {"height": 2.0}}, {**{n: np.zeros(3) for n in ANGLES}, **depth})
    expected = (2.0 + 0.5 / 1.333) / (2.0 + depth["z"] / 1.333)
    np.testing.assert_allclose(seen["x"], expected, rtol=1e-12)
    np.testing.assert_allclose(seen["y"], -expected, rtol=1e-12)


def test_soft_iron_bends_the_heading_twice_in_a_turn():
    heading = {n: np.zeros(5) for n in ANGLES} | {"yaw": np.linspace(0.0, 2 * np.pi, 5)}
    seen = measured({"soft_iron": {"amplitude": 0.1, "angle": 0.4}}, heading)
    np.testing.assert_allclose(
        seen["yaw"] - heading["yaw"], 0.1 * np.sin(2 * heading["yaw"] + 0.4), atol=1e-12
    )


def test_a_gyro_scale_comes_before_the_bias():
    both = {"gyro_bias": {"r": 0.02}, "gyro_scale": {"p": 0.9, "r": 1.1}}
    seen = measured(both)
    np.testing.assert_allclose(seen["p"], 0.9 * CHANNELS["p"])
    np.testing.assert_allclose(seen["r"], 1.1 * CHANNELS["r"] + 0.02)
    np.testing.assert_array_equal(seen["q"], CHANNELS["q"])


def test_a_marker_follows_the_hull_and_not_the_sensor():
    """Together, the camera still sees the true attitude."""
    marker = {"marker_offset": {"x": 0.06}}
    both = {**marker, "attitude_misalignment": {"yaw": 0.3}}
    np.testing.assert_array_equal(measured(both)["x"], measured(marker)["x"])


def test_scale_and_bias_of_the_depth_compose_in_one_order():
    """The sensor's zero first, then the scale, however they were given."""
    both = {"depth_bias": {"offset": 0.1}, "position_scale": {"scale": 2.0}}
    for effects in (both, dict(reversed(both.items()))):
        np.testing.assert_allclose(measured(effects)["z"], 2.0 * (CHANNELS["z"] + 0.1))


def test_a_channel_that_was_not_measured_is_not_invented():
    only = {"x": CHANNELS["x"]}
    for name, values in (
        ("gyro_bias", {"p": 0.1}),
        ("attitude_misalignment", {"yaw": 0.1}),
        ("depth_bias", {"offset": 0.1}),
        ("position_scale", {"scale": 1.1}),
    ):
        assert set(measured({name: values}, only)) == {"x"}


def test_the_true_channels_are_left_alone():
    before = {name: values.copy() for name, values in CHANNELS.items()}
    measured({"depth_bias": {"offset": 0.1}, "gyro_bias": {"p": 0.1}})
    for name, values in before.items():
        np.testing.assert_array_equal(CHANNELS[name], values)


def test_a_sensor_delay_shows_older_states():
    """What is recorded at t is the state at t - delay."""
    model = build_model(swimmer(), {"sensor_delay": {"delay": 0.05}})
    np.testing.assert_allclose(true_times(model, [0.1, 1.0]), [0.05, 0.95], atol=1e-15)


def test_a_clock_turns_its_stamps_into_time_before_the_delay_counts():
    """scale x stamp - delay, in whichever order the effects were given."""
    both = {"sensor_delay": {"delay": 0.05}, "clock_scale": {"scale": 1.1}}
    for effects in (both, dict(reversed(both.items()))):
        model = build_model(swimmer(), effects)
        np.testing.assert_allclose(true_times(model, [2.0]), [2.2 - 0.05])


def test_measurement_effects_leave_the_lean_kernel():
    effects = {"sensor_delay": {"delay": 0.1}, "gyro_bias": {"p": 0.1}}
    assert build_model(swimmer(), effects).declared == ()


def test_a_late_camera_shows_where_the_fish_was():
    """Against a simulation that is sampled at the earlier times; other channels stay."""
    times = np.arange(0.0, 4.01, 0.04)
    commands = CommandSteps(np.array([0.0]), np.array([[0.2, 0.4, 1.5, 0.0, 0.0]]))
    run = Run("r0", times, dict.fromkeys(("x", "y", "z", "yaw", "r"), times), commands, "rest")
    start, late = (
        InitialState(position=(0.0, 0.0, 1.0)),
        {"camera_later": 0.065, "depth_later": 0.02},
    )
    shown = simulate_run(Simulator(swimmer(), effects={"sensor_delay": late}), run, start)
    plain = Simulator(swimmer())
    now = simulate_run(plain, run, start)
    for name, age in (("x", 0.065), ("y", 0.065), ("z", 0.02)):
        was = np.unique(np.maximum(times - age, 0.0))
        states = plain.run(commands, initial=start, sample_times_s=was)
        rows = np.searchsorted(was, np.maximum(times - age, 0.0))
        np.testing.assert_allclose(shown[name], states.channels[name][rows], atol=1e-6)
        assert np.abs(shown[name] - now[name]).max() > 1e-5
    for name in ("yaw", "r"):
        np.testing.assert_allclose(shown[name], now[name], atol=1e-6)


@pytest.mark.parametrize("frequency", [0.8, 1.5])
def test_a_filtered_inertial_unit_is_late_by_what_a_butterworth_filter_is(frequency):
    """A beat that scipy's filter has passed, and the same beat earlier by the effect's delay."""
    cutoff, step = 5.0, 0.001
    model = build_model(swimmer(), {"imu_lowpass": {"cutoff": cutoff}})
    ages = ages_s(model, ("x", "z", "yaw", "r"))
    assert ages["x"] == ages["z"] == 0.0
    assert ages["yaw"] == ages["r"]
    times = np.arange(0.0, 10.0, step)
    sections = butter(2, cutoff, fs=1.0 / step, output="sos")
    filtered = sosfilt(sections, np.sin(2.0 * np.pi * frequency * times))[times > 5.0]
    late = np.sin(2.0 * np.pi * frequency * (times - ages["yaw"]))[times > 5.0]
    assert np.abs(filtered - late).max() < 0.02
    now = np.sin(2.0 * np.pi * frequency * times)[times > 5.0]
    assert np.abs(filtered - now).max() > 0.2


def test_an_unfiltered_inertial_unit_is_on_time():
    model = build_model(swimmer(), {"imu_lowpass": {}})
    assert set(ages_s(model, ("x", "yaw", "r")).values()) == {0.0}
