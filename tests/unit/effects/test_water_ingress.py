"""A leak: the fish sinks ever faster."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import dry, swimmer
from tests.unit.effects.support import MASS, REST, STILL, balanced, run

RATE = 0.004
EFFECTS = {"water_ingress": {"rate": RATE}}


def test_a_leaking_fish_falls_with_the_cube_of_time():
    """(m + w) z'' = w g, w = rate t, without drag: m z'' = rate g t while w is small."""
    fall = run(EFFECTS, STILL, 3.0, fish=dry(balanced(), gravity=9.81))
    expected = RATE * 9.81 * fall.time_s**3 / (6 * MASS)
    np.testing.assert_allclose(fall["z"], expected, rtol=0.01)


def test_time_is_that_of_the_run():
    """A state late in a run has taken in more water."""
    simulator = Simulator(balanced(), effects=EFFECTS)
    sinking = simulator.state_derivative(REST, time_s=30.0)[9]
    water = RATE * 30.0
    np.testing.assert_allclose(sinking, water * 9.81 / (MASS + water), rtol=1e-12)


def test_water_in_the_nose_presses_it_down():
    """It weighs w g at x: M = (x, 0, 0) x (0, 0, w g), about O_b; its inertia is w x^2."""
    nose = {"water_ingress": {"rate": RATE, "x": 0.05}}
    simulator, dry_one = Simulator(swimmer(), effects=nose), Simulator(swimmer())
    moment = simulator.wrench_by_term(REST, time_s=10.0)["gravity"]
    before = dry_one.wrench_by_term(REST)["gravity"]
    water = RATE * 10.0
    np.testing.assert_allclose(moment - before, [0, 0, water * 9.81, 0, -0.05 * water * 9.81, 0],
                               atol=1e-12)  # fmt: skip
    assert simulator.state_derivative(REST, time_s=10.0)[11] < -1e-3
