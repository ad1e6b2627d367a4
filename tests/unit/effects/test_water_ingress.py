"""A leak: the fish sinks ever faster."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import dry
from tests.unit.effects.support import MASS, REST, STILL, balanced, run

RATE = 0.004
EFFECTS = {"water_ingress": {"rate": RATE}}


def test_a_leaking_fish_falls_with_the_cube_of_time():
    """m z'' = rate g t, without drag."""
    fall = run(EFFECTS, STILL, 3.0, fish=dry(balanced(), gravity=9.81))
    np.testing.assert_allclose(fall["z"], RATE * 9.81 * fall.time_s**3 / (6 * MASS), atol=1e-12)


def test_time_is_that_of_the_run():
    """A state late in a run has lost more."""
    simulator = Simulator(balanced(), effects=EFFECTS)
    sinking = simulator.state_derivative(REST, time_s=30.0)[9]
    np.testing.assert_allclose(sinking, RATE * 30.0 * 9.81 / MASS, rtol=1e-12)
