"""A tail with a gain swims like one that is told another amplitude."""

import numpy as np

from tests.unit.effects.support import BEAT, assert_same_motion, run, tail

EFFECTS = {"tail_gain": {"gain": 0.7}}


def test_a_gain_scales_the_amplitude_and_not_the_offset():
    assert_same_motion(run(EFFECTS), run(None, [{**BEAT[0], "tail_amplitude": 0.21}]))
    angle, rate = tail(EFFECTS, run(EFFECTS, rate_hz=400))
    np.testing.assert_allclose([angle.min(), angle.max()], [0.1 - 0.21, 0.1 + 0.21], atol=1e-3)
    np.testing.assert_allclose(np.abs(rate).max(), 4 * np.pi * 0.21, rtol=1e-3)


def test_a_held_offset_is_held_where_it_was_told():
    """With no swing there is nothing to scale."""
    hold = [{"t": 0.0, "tail_offset": 0.3}]
    assert_same_motion(run(EFFECTS, hold), run(None, hold), atol=0.0)
