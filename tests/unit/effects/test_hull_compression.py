"""A hull that yields to pressure: an unstable depth."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import dry
from tests.unit.effects.support import MASS, REST, STILL, balanced, run

RATE = 0.05
EFFECTS = {"hull_compression": {"rate": RATE}}


def test_a_fish_leaves_its_neutral_depth_exponentially():
    """m z'' = rate g z: z = z0 cosh(k t), k^2 = rate g / m, without drag."""
    fish = dry(balanced(), gravity=9.81)
    sink = run(EFFECTS, STILL, 3.0, fish=fish, position=(0.0, 0.0, 0.02))
    k = np.sqrt(RATE * 9.81 / MASS)
    np.testing.assert_allclose(sink["z"], 0.02 * np.cosh(k * sink.time_s), atol=1e-8)


def test_buoyancy_falls_with_depth_alone():
    """At any attitude, with the depth of O_b; it has no moment about it."""
    deep = REST.copy()
    deep[0:3] = 3.0, -2.0, 1.5
    terms = Simulator(balanced(), effects=EFFECTS).wrench_by_term(deep)
    np.testing.assert_allclose(terms["buoyancy"][2], -(2.0 - RATE * 1.5) * 9.81, rtol=1e-14)
    assert not terms["buoyancy"][3:].any()
