"""A tether is a spring to a point."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import MASS, REST, STILL, in_space, run

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


def test_a_slack_cable_does_not_pull():
    """Within its slack length nothing; beyond, in proportion to what it is stretched by."""
    slack = {"tether": {**EFFECTS["tether"], "slack": 5.0}}
    assert not Simulator(swimmer(), effects=slack).wrench_by_term(REST)["tether"].any()
    length = np.linalg.norm(ANCHOR)
    taut = {"tether": {**EFFECTS["tether"], "slack": 0.4}}
    force = Simulator(swimmer(), effects=taut).wrench_by_term(REST)["tether"][:3]
    np.testing.assert_allclose(force, K * (length - 0.4) * ANCHOR / length, rtol=1e-12)


def test_a_cable_at_the_tail_turns_the_fish():
    """M = r_a x F, and the cable runs from its own end, wherever the fish is turned."""
    state = REST.copy()
    state[3:7] = np.cos(0.3), 0.0, 0.0, np.sin(0.3)  # yaw 0.6
    aft = {"tether": {**EFFECTS["tether"], "attach_x": -0.12}}
    wrench = Simulator(swimmer(), effects=aft).wrench_by_term(state)["tether"]
    turn = np.array([[np.cos(0.6), -np.sin(0.6), 0], [np.sin(0.6), np.cos(0.6), 0], [0, 0, 1]])
    arm = np.array([-0.12, 0.0, 0.0])
    force = turn.T @ (K * (ANCHOR - turn @ arm))
    np.testing.assert_allclose(wrench[:3], force, rtol=1e-12)
    np.testing.assert_allclose(wrench[3:], np.cross(arm, force), rtol=1e-12, atol=1e-15)
