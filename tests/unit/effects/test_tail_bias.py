"""A biased tail swims like one that is told another offset."""

import numpy as np

from tests.unit.effects.support import BEAT, assert_same_motion, run, tail

EFFECTS = {"tail_bias": {"offset": 0.08}}


def test_a_bias_is_an_offset_of_the_command():
    """The same motion as without the effect at the sum of both offsets."""
    assert_same_motion(run(EFFECTS), run(None, [{**BEAT[0], "tail_offset": 0.18}]))


def test_a_tail_told_to_be_straight_stands_at_the_bias():
    """And the fish, once pushed, turns."""
    drift = run(EFFECTS, [{"t": 0.0}], 3.0, velocity_body=(0.3, 0.0, 0.0))
    np.testing.assert_allclose(tail(EFFECTS, drift)[0], 0.08)
    assert drift["r"][-1] < -1e-3


def test_it_is_no_drag_of_an_offset():
    """The offset that was commanded stays what it is for effects that depend on it."""
    braked = {**EFFECTS, "offset_drag": {"coefficient": 20.0}}
    straight = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0}]
    assert_same_motion(run(braked, straight), run(EFFECTS, straight))
    assert run(braked, seconds=4.0)["x"][-1] < run(EFFECTS, seconds=4.0)["x"][-1] - 1e-5
