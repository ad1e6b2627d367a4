"""Accelerations of any fish in any state equal those of the independent implementation."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fish_env.simulator import Simulator
from tests import reference_model
from tests.physics.cases import random_inputs, random_states, random_values, swimmer

# Next to 90 degrees the reference's arcsin loses digits, so no motion is next to nothing.
factor = st.just(0.0) | st.floats(0.05, 10.0)


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), speed=factor, spin=factor)
def test_any_fish_in_any_state(seed, speed, spin):
    """Parameters, attitude, velocities up to ten times the usual, phase and actuators at random."""
    rng = np.random.default_rng(seed)
    fish = swimmer().replace(random_values(rng))
    state, inputs = random_states(rng, 1)[0], random_inputs(rng, 1)[0]
    state[7:10] *= speed
    state[10:13] *= spin
    expected = reference_model.derivative(fish.values(), state[:13], state[13], inputs)
    actual = Simulator(fish).state_derivative(state, inputs)[:13]
    scale = np.abs(expected).max() + 1.0
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-11 * scale)


axis_speed = st.sampled_from([0.0, 0.3, -0.3, 1e-3])


@settings(max_examples=60, deadline=None)
@given(velocity=st.tuples(axis_speed, axis_speed, axis_speed), yaw_rate=axis_speed)
def test_flow_along_an_axis_or_none(velocity, yaw_rate):
    """Where an angle of attack is 0, 90 degrees or undefined, both still agree."""
    state = np.array([0, 0, 0, 1, 0, 0, 0, *velocity, 0, 0, yaw_rate], float)
    expected = reference_model.derivative(swimmer().values(), state, 0.0, np.zeros(5))
    actual = Simulator(swimmer()).state_derivative(state)[:13]
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-11)
