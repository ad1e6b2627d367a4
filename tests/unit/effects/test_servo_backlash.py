"""Play between servo and tail."""

import numpy as np
import pytest

from fish_env.effects import get_effect
from tests.unit.effects.support import assert_same_motion, run, tail

GAP = 0.1
EFFECTS = {"servo_backlash": {"gap": GAP}}
SWING = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 1.0}]


def test_the_tail_loses_half_the_gap_on_either_side():
    """And stands at each reversal until the servo has turned back by the whole gap."""
    swim = run(EFFECTS, SWING, 3.0, rate_hz=200)
    angle, rate = tail(EFFECTS, swim)
    assert angle.max() == pytest.approx(0.3 - GAP / 2, abs=2e-5)
    assert angle.min() == pytest.approx(-0.3 + GAP / 2, abs=2e-5)
    standing = np.mean(rate[swim.time_s >= 1.0] == 0.0)
    dead = 2 * np.arccos(1 - GAP / 0.3) / (2 * np.pi)
    assert standing == pytest.approx(dead, abs=0.01)


def test_the_tail_stays_within_the_play_of_the_servo():
    """And moves only in contact, with the servo's own rate but for a step at either end."""
    swim = run(EFFECTS, SWING, 2.0, rate_hz=200)
    angle, rate = tail(EFFECTS, swim)
    servo = 0.3 * np.sin(2 * np.pi * swim.time_s)
    servo_rate = 0.6 * np.pi * np.cos(2 * np.pi * swim.time_s)
    assert np.all(np.abs(angle - servo) <= GAP / 2 + 1e-9)
    moving = np.convolve(rate != 0.0, np.ones(9), "same") == 9
    assert 0.5 < moving.mean() < 0.8
    np.testing.assert_allclose(rate[moving], servo_rate[moving], atol=1e-9)
    contact = np.sign(servo_rate) * GAP / 2
    np.testing.assert_allclose((servo - angle)[moving], contact[moving], atol=1e-7)


def play(command, gap):
    """The play operator on a fine grid."""
    angle = np.empty_like(command)
    angle[0] = command[0] - gap / 2
    for i in range(1, len(command)):
        angle[i] = np.clip(angle[i - 1], command[i] - gap / 2, command[i] + gap / 2)
    return angle


def test_the_angle_is_that_of_the_play_operator():
    """Also between reversals that lie within a step."""
    swim = run(EFFECTS, SWING, 2.0, rate_hz=100)
    fine = np.linspace(0.0, 2.0, 20001)
    expected = play(0.3 * np.sin(2 * np.pi * fine), GAP)[::100]
    np.testing.assert_allclose(tail(EFFECTS, swim)[0], expected, atol=3e-5)


def test_a_servo_that_moves_less_than_the_gap_moves_nothing():
    still = run(
        EFFECTS, [{"t": 0.0}, {"t": 0.2, "tail_amplitude": 0.04, "tail_frequency": 2.0}], 2.0
    )
    angle, rate = tail(EFFECTS, still)
    assert not angle.any()
    assert not rate.any()


def test_a_held_tail_may_stand_anywhere_within_the_play():
    """From above it rests half a gap high, from below half a gap low."""
    for start, side in ((0.3, 1.0), (-0.3, -1.0)):
        commands = [{"t": 0.0, "tail_offset": start}, {"t": 0.2, "tail_offset": 0.0}]
        assert tail(EFFECTS, run(EFFECTS, commands, 0.5))[0][-1] == pytest.approx(side * GAP / 2)


def test_the_play_comes_after_the_servo():
    """With a lag as well, the lagged angle has the play, and moves the tail without a break."""
    both = {**EFFECTS, "servo_lag": {"time_constant": 0.1}}
    angle, rate = tail(both, run(both, SWING, 4.0, rate_hz=100))
    lagged = 0.3 / np.hypot(1.0, 2 * np.pi * 0.1)
    assert angle[-100:].max() == pytest.approx(lagged - GAP / 2, abs=1e-4)
    dead = 2 * np.arccos(1 - GAP / lagged) / (2 * np.pi)
    assert np.mean(rate[-100:] == 0.0) == pytest.approx(dead, abs=0.03)


def test_no_gap_is_off():
    assert_same_motion(run({"servo_backlash": {"gap": 0.0}}, SWING), run(None, SWING), atol=0.0)
    assert get_effect("servo_backlash").time_scale({"gap": 0.0}) == np.inf
