"""Delays, biases and scales of what is recorded."""

import numpy as np
import pytest

from fish_env.effects.extended import build_model
from fish_env.sensing import measured_channels, true_times
from tests.physics.cases import swimmer

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
        ("attitude_misalignment", {"roll": 0.01, "pitch": -0.02, "yaw": 0.05}),
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
