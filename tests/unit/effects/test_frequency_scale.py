"""A tail with another clock beats at another frequency."""

import numpy as np

from tests.unit.effects.support import BEAT, assert_same_motion, run

EFFECTS = {"frequency_scale": {"scale": 0.9}}


def test_it_equals_another_commanded_frequency():
    assert_same_motion(run(EFFECTS), run(None, [{**BEAT[0], "tail_frequency": 1.8}]))


def test_the_phase_advances_at_the_scaled_frequency():
    swim = run(EFFECTS, seconds=2.0)
    np.testing.assert_allclose(swim["tail_phase"], 2 * np.pi * 1.8 * swim.time_s, atol=1e-12)
