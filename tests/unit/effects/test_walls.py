"""More drag near a wall and near the floor, in shares that add."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import random_inputs, random_states, swimmer

WALL = {"gain": 1.5, "distance": 0.6, "heading": 2.2, "range": 0.3}
FLOOR = {"gain": 0.7, "depth": 1.2, "range": 0.2}
SURFACE = {"gain": 0.8, "depth": 0.1}
DRAGS = ("xz_drag", "xy_drag")


def at_wall(x, y):
    away = max(WALL["distance"] - x * np.cos(2.2) - y * np.sin(2.2), 0.0)
    return WALL["gain"] * np.exp(-away / WALL["range"])


def at_floor(z):
    return FLOOR["gain"] * np.exp(-max(FLOOR["depth"] - z, 0.0) / FLOOR["range"])


def assert_raised(effects, share, seed):
    """Both drags x (1 + share of the place); lift, impact moments and the tail stay."""
    rng = np.random.default_rng(seed)
    near, plain = Simulator(swimmer(), effects=effects), Simulator(swimmer())
    for state, inputs in zip(random_states(rng, 10), random_inputs(rng, 10), strict=True):
        state[2] = abs(state[2])
        here, far = near.wrench_by_term(state, inputs), plain.wrench_by_term(state, inputs)
        for name in far:
            factor = 1.0 + share(*state[:3]) if name in DRAGS else 1.0
            np.testing.assert_allclose(here[name], factor * far[name], rtol=1e-10, err_msg=name)


def test_drag_grows_towards_the_wall():
    assert_raised({"wall_effect": WALL}, lambda x, y, z: at_wall(x, y), 1)


def test_drag_grows_towards_the_floor():
    assert_raised({"floor_effect": FLOOR}, lambda x, y, z: at_floor(z), 2)


def test_shares_of_surface_floor_and_wall_add():
    """A product of the three would differ; near two of them by a large part."""

    def share(x, y, z):
        return at_wall(x, y) + at_floor(z) + SURFACE["gain"] * np.exp(-z / SURFACE["depth"])

    effects = {"wall_effect": WALL, "floor_effect": FLOOR, "surface_drag": SURFACE}
    assert_raised(effects, share, 3)
    with pytest.raises(AssertionError):
        assert_raised(effects, lambda x, y, z: 1.2 * share(x, y, z), 3)
