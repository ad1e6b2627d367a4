"""Trapped air: buoyancy at one point that the pressure compresses."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import dry, random_states, rotation, swimmer
from tests.unit.effects.support import MASS, REST, STILL, balanced, run

AIR = {"bubbles": {"mass": 0.01, "x": 0.04}}


def test_air_pulls_the_nose_up_and_acts_like_a_weight_that_is_taken_away():
    """Same force and moment as minus that mass at the same point, at every attitude."""
    simulator = Simulator(swimmer(), effects=AIR)
    for state in random_states(np.random.default_rng(3), 5):
        state[2] = 0.0
        down = rotation(state)[2]
        force = -0.01 * 9.81 * down
        moment = np.cross([0.04, 0.0, -0.03], force)
        np.testing.assert_allclose(
            simulator.wrench_by_term(state)["bubbles"], [*force, *moment], atol=1e-14
        )
    assert simulator.wrench_by_term(REST)["bubbles"][4] > 0.0


def test_depth_halves_the_air_at_twice_the_pressure():
    deep = REST.copy()
    deep[2] = 10.3
    terms = Simulator(swimmer(), effects=AIR).wrench_by_term(deep)
    np.testing.assert_allclose(terms["bubbles"][2], -0.005 * 9.81, rtol=1e-12)


def test_a_neutral_depth_is_unstable():
    """m z'' = mass g / 10.3 (z - z0) close to it: the air trims the fish at z0 alone."""
    depth, mass = 1.0, 0.4
    left = MASS - mass / (1.0 + depth / 10.3)
    fish = dry(balanced().replace({"mass.buoyancy": left}), gravity=9.81)
    air = {"bubbles": {"mass": mass, "x": 0.0}}
    fall = run(air, STILL, 3.0, fish=fish, position=(0.0, 0.0, depth + 1e-3))
    growth = np.sqrt(mass * 9.81 / (10.3 * (1.0 + depth / 10.3) ** 2) / MASS)
    wanted = depth + 1e-3 * np.cosh(growth * fall.time_s)
    np.testing.assert_allclose(fall["z"], wanted, atol=2e-6)
