"""Servo lag against first-order theory."""

import numpy as np
import pytest

from fish_env.effects.extended import build_model
from fish_env.simulator import Simulator
from tests.physics.cases import swimmer

LAG = 0.08


@pytest.mark.parametrize("frequency", [0.5, 2.0, 3.5])
def test_gain_and_phase_are_those_of_a_first_order_lag(frequency):
    """1 / (1 + i omega T): amplitude falls, phase falls behind, the mean stays."""
    simulator = Simulator(swimmer(), 0.002, {"servo_lag": {"time_constant": LAG}})
    commands = [{"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.3, "tail_frequency": frequency}]
    settled = np.ceil(20 * LAG * frequency) / frequency
    times = settled + np.arange(65) / (64 * frequency)
    run = simulator.run(commands, sample_times_s=np.concatenate([[0.0], times]))
    angle = simulator.outputs(run)["tail_angle"][1:-1]
    turn = np.exp(-2j * np.pi * frequency * times[:-1])
    response = 2j * np.mean(angle * turn) / 0.3
    expected = 1.0 / (1.0 + 2j * np.pi * frequency * LAG)
    assert response == pytest.approx(expected, abs=1e-6)
    assert np.mean(angle) == pytest.approx(0.1, abs=1e-6)


def test_a_step_is_followed_exponentially():
    """xi = offset (1 - exp(-t/T)), rate and all: the step is met exactly."""
    simulator = Simulator(swimmer(), 0.005, {"servo_lag": {"time_constant": LAG}})
    run = simulator.run([{"t": 0.0}, {"t": 0.1, "tail_offset": 0.4}], duration_s=0.5, rate_hz=50)
    outputs = simulator.outputs(run)
    since = np.maximum(run.time_s - 0.1, 0.0)
    expected = 0.4 * (1 - np.exp(-since / LAG))
    np.testing.assert_allclose(outputs["tail_angle"], expected, atol=1e-6)
    moving = run.time_s > 0.1 + 1e-9
    rate = 0.4 / LAG * np.exp(-since[moving] / LAG)
    np.testing.assert_allclose(outputs["tail_rate"][moving], rate, atol=2e-5)


def test_the_tail_starts_where_it_is_commanded():
    """No jump at the start: the state is set from offset, amplitude and phase."""
    simulator = Simulator(swimmer(), 0.01, {"servo_lag": {"time_constant": LAG}})
    run = simulator.run([{"t": 0.0, "tail_offset": 0.25}], duration_s=0.3)
    np.testing.assert_allclose(simulator.outputs(run)["tail_angle"], 0.25, atol=1e-12)


def test_a_short_lag_tends_to_the_ideal_servo():
    """Halving the time constant halves the difference."""
    commands = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 1.0}]
    ideal = Simulator(swimmer(), 0.001).run(commands, duration_s=2.0).states[-1, 7:10]
    ends = [
        Simulator(swimmer(), 0.001, {"servo_lag": {"time_constant": lag}})
        .run(commands, duration_s=2.0)
        .states[-1, 7:10]
        for lag in (0.004, 0.002)
    ]
    far, near = (np.linalg.norm(end - ideal) for end in ends)
    assert far / near == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("lag", [0.004, 0.0007])
def test_a_lag_shorter_than_the_step_is_followed(lag):
    """The step is divided until it resolves the lag; one as long as the lag alone would not do."""
    short = {"servo_lag": {"time_constant": lag}}
    commands = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0}]
    coarse, fine, ideal = (
        Simulator(swimmer(), dt, effects).run(commands, duration_s=2.0).states[-1, 7:13]
        for dt, effects in ((0.01, short), (0.0002, short), (0.0002, None))
    )
    assert np.linalg.norm(coarse - fine) < 0.02 * np.linalg.norm(fine - ideal)
    assert Simulator(swimmer(), 0.01, short).dt <= lag
    assert Simulator(swimmer(), 0.01, {"servo_lag": {"time_constant": 0.0}}).dt == 0.01


def test_the_longest_step_is_that_of_the_effects_that_are_on():
    assert build_model(swimmer()).longest_step() == np.inf
    assert build_model(swimmer(), {"servo_lag": {"time_constant": 0.03}}).longest_step() == 0.03
