"""A servo that turns only so fast."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import assert_same_motion, run, tail

SWING = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0}]
PEAK = 4 * np.pi * 0.3


def limited(rate):
    return {"servo_rate_limit": {"rate": rate}}


def test_a_fast_servo_follows_exactly():
    """A limit above the command's peak rate changes nothing."""
    assert_same_motion(run(limited(1.01 * PEAK), SWING), run(None, SWING), atol=1e-12)


@pytest.mark.parametrize("rate", [0.5, 2.0, 3.5])
def test_the_limit_is_kept(rate):
    """In the rate that the water sees, and from sample to sample."""
    swim = run(limited(rate), [*SWING, {"t": 0.7, "tail_offset": 0.4}], 2.0, rate_hz=200)
    angle, slope = tail(limited(rate), swim)
    assert np.abs(slope).max() <= rate
    assert np.abs(np.diff(angle)).max() <= rate / 200 * (1 + 1e-9)


def test_a_step_becomes_a_ramp_that_ends_on_the_command():
    """Rate, and rest once there; exactly, however long the physics step."""
    step = [{"t": 0.0}, {"t": 0.1, "tail_offset": 0.4}]
    for dt in (0.01, 0.0073):
        ramp = run(limited(1.5), step, 0.6, dt=dt)
        angle, rate = tail(limited(1.5), ramp)
        expected = np.clip(1.5 * (ramp.time_s - 0.1), 0.0, 0.4)
        np.testing.assert_allclose(angle, expected, atol=1e-12)
        assert rate[-1] == 0.0
        assert rate[10] == pytest.approx(1.5)


def test_a_stroke_far_too_fast_becomes_a_triangle():
    """A quarter beat at full rate is all the swing that is left: amplitude rate / (4 f)."""
    rate = 0.6
    swim = run(limited(rate), SWING, 6.0, rate_hz=400)
    angle, _ = tail(limited(rate), swim)
    late = angle[swim.time_s > 5.5]
    assert np.ptp(late) / 2 == pytest.approx(rate / 8.0, rel=0.02)


def exact(rate, time_s):
    """The limited angle by brute force: a hundred steps in each sample."""
    fine = np.linspace(0.0, time_s[-1], 100 * (len(time_s) - 1) + 1)
    command = 0.3 * np.sin(4 * np.pi * fine)
    angle = np.zeros_like(fine)
    for i in range(1, len(fine)):
        reach = rate * (fine[i] - fine[i - 1])
        angle[i] = angle[i - 1] + np.clip(command[i] - angle[i - 1], -reach, reach)
    return angle[::100]


def test_the_angle_is_exact_between_the_extremes():
    """Where the tail leaves its command and meets it again, to the accuracy of one step."""
    swim = run(limited(3.0), SWING, 2.0, rate_hz=100)
    angle, _ = tail(limited(3.0), swim)
    np.testing.assert_allclose(angle, exact(3.0, swim.time_s), atol=5e-4)


def test_the_acceleration_integrates_to_the_rate():
    """Jumps of the rate reach the water's inertia: what settles is the rate itself."""
    swim = run(limited(1.5), [{"t": 0.0}, {"t": 0.1, "tail_offset": 0.4}], 0.6, rate_hz=200)
    settled = swim["servo_rate_limit.settled_rate"]
    during = (swim.time_s > 0.25) & (swim.time_s < 0.36)
    np.testing.assert_allclose(settled[during], 1.5, rtol=2e-3)
    assert abs(settled[-1]) < 1e-3


def test_an_infinite_rate_is_off():
    """No NaN comes from it, and the same bits as without."""
    with_current = {"current": {"north": 0.1}}
    one = run({**with_current, "servo_rate_limit": {"rate": np.inf}}, SWING)
    assert np.array_equal(one.states[:, :18], run(with_current, SWING).states[:, :18])
    assert Simulator(swimmer(), 0.01, limited(np.inf)).model.declared == ()
