"""A tether is a spring to a point."""

import numpy as np

from tests.unit.effects.support import MASS, STILL, in_space, run

K = 0.5
ANCHOR = np.array([1.0, -0.5, 0.3])
EFFECTS = {"tether": {"stiffness": K, "x": 1.0, "y": -0.5, "z": 0.3}}


def test_a_fish_swings_about_the_anchor():
    """C_I - anchor = (start - anchor) cos(w t), w^2 = k / m, whatever its attitude."""
    for euler in ((0.0, 0.0, 0.0), (0.7, -0.4, 2.5)):
        swing = run(EFFECTS, STILL, 8.0, fish=in_space(), euler=euler)
        wave = np.cos(np.sqrt(K / MASS) * swing.time_s)
        expected = ANCHOR + np.outer(wave, -ANCHOR)
        np.testing.assert_allclose(swing.states[:, :3], expected, atol=1e-8)


def test_it_does_not_turn_the_fish():
    """It pulls at O_b, here the centre of mass."""
    swing = run(EFFECTS, STILL, 3.0, fish=in_space())
    np.testing.assert_allclose(swing.states[:, 10:13], 0.0, atol=1e-14)
