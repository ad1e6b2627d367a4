"""More drag near the surface."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import random_inputs, random_states, swimmer

EFFECTS = {"surface_drag": {"gain": 0.8, "depth": 0.1}}
DRAGS = ("xz_drag", "xy_drag")


@pytest.mark.parametrize("depth", [0.0, 0.05, 0.3, 2.0])
def test_the_bodys_drag_grows_towards_the_surface(depth):
    """x (1 + gain exp(-z/depth)); lift, impact moments and the tail stay as they are."""
    rng = np.random.default_rng(5)
    near, plain = Simulator(swimmer(), effects=EFFECTS), Simulator(swimmer())
    for state, inputs in zip(random_states(rng, 5), random_inputs(rng, 5), strict=True):
        state[2] = depth
        here, deep = near.wrench_by_term(state, inputs), plain.wrench_by_term(state, inputs)
        for name in deep:
            factor = 1 + 0.8 * np.exp(-depth / 0.1) if name in DRAGS else 1.0
            np.testing.assert_allclose(here[name], factor * deep[name], rtol=1e-11, err_msg=name)


def test_above_the_surface_it_grows_no_more():
    state = np.array([0, 0, -0.5, 1, 0, 0, 0, 0.2, 0, 0, 0, 0, 0], float)
    above = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state)["xz_drag"]
    state[2] = 0.0
    at = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state)["xz_drag"]
    np.testing.assert_array_equal(above, at)
