"""Where a goal goes is foreseen for sines and ramps, and not for steps."""

import numpy as np
import pytest

from robofish_agents.training.course import Course

PERIOD = 0.1
TIMES = np.arange(0.0, 12.0, PERIOD)


def followed(rate) -> Course:
    course = Course(0.05, PERIOD)
    course.reset(1)
    for time in TIMES:
        course.see(np.array([rate(time)]))
    return course


@pytest.mark.parametrize("period_s", [15.0, 22.0, 30.0])
def test_a_sine_goes_on_as_a_sine(period_s):
    omega, size = 2.0 * np.pi / period_s, 0.12
    course = followed(lambda time: size * omega * np.cos(omega * time))
    now, later = TIMES[-1], TIMES[-1] + 3.0
    assert course.omega == pytest.approx(omega, rel=0.03)
    assert course.fastest == pytest.approx(size * omega, rel=0.03)
    assert course.rate_in(3.0) == pytest.approx(size * omega * np.cos(omega * later), abs=2e-3)
    moved = size * (np.sin(omega * later) - np.sin(omega * now))
    assert course.change_in(3.0) == pytest.approx(moved, abs=5e-3)


def test_a_ramp_goes_on_as_a_ramp():
    course = followed(lambda time: 0.015 if time > 5.0 else 0.0)
    assert course.rate_in(2.0) == pytest.approx(0.015, rel=1e-3)
    assert course.change_in(2.0) == pytest.approx(0.03, rel=1e-3)


def test_the_beginning_of_a_ramp_is_no_swing():
    course = Course(0.05, PERIOD)
    course.reset(1)
    for rate in (0.0, 0.0, 0.015):
        course.see(np.array([rate]))
    assert course.rate_in(2.0) == pytest.approx(0.015, rel=1e-3)


def test_reset_forgets():
    course = followed(lambda time: 0.05 * np.cos(0.4 * time))
    course.reset(2)
    course.see(np.zeros(2))
    assert not course.change_in(3.0).any()
