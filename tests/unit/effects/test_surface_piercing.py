"""A hull partly out of the water: lost buoyancy, and the moment of what is left."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import dry, random_states, rotation, swimmer
from tests.unit.effects.support import MASS, REST, STILL, balanced, run

HEIGHT = 0.05
SPHERE = {"surface_piercing": {"height": HEIGHT}}
LONG = {"surface_piercing": {"height": HEIGHT, "slenderness": 3.0}}
CELLS = 120
WEIGHT = 2.0 * 9.81


def summed(state, slenderness):
    """Force and moment that cells of the hull above the surface no longer give, from a grid."""
    axis = (np.arange(CELLS) + 0.5) / CELLS * 2.0 - 1.0
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = grid[(grid**2).sum(axis=1) < 1.0] * HEIGHT * np.array([slenderness, 1.0, 1.0])
    turn = rotation(state)
    dry_ones = cells[state[2] + cells @ turn[2] < 0.0]
    force = WEIGHT / len(cells) * turn[2]
    return np.concatenate([len(dry_ones) * force, np.cross(dry_ones.sum(axis=0), force)])


def pierced(state, effects):
    return Simulator(balanced(), effects=effects).wrench_by_term(state)["surface_piercing"]


def worst(slenderness, effects):
    """Largest difference to the grid at random attitudes and depths, in parts of weight and arm."""
    rng, worst = np.random.default_rng(2), 0.0
    for state in random_states(rng, 8):
        state[2] = rng.uniform(-0.04, 0.06)
        apart = np.abs(summed(state, slenderness) - pierced(state, effects))
        worst = max(worst, apart[:3].max() / WEIGHT, apart[3:].max() / (WEIGHT * HEIGHT))
    return worst


def test_a_grid_of_cells_gives_the_same_force_and_moment():
    assert worst(1.0, SPHERE) < 0.004
    assert worst(3.0, LONG) < 0.004


def test_the_grid_notices_a_hull_of_another_length():
    assert worst(3.0, SPHERE) > 0.1


def test_a_floating_fish_bobs_at_the_frequency_of_its_waterplane():
    """m z'' = -m_b g 3 z / 4 height about z = 0, where half the hull is out and m = m_b / 2."""
    fish = dry(balanced().replace({"mass.buoyancy": 2.0 * MASS}), gravity=9.81)
    start = 0.0005
    bob = run(SPHERE, STILL, 2.0, fish=fish, position=(0.0, 0.0, start), dt=0.005)
    omega = np.sqrt(1.5 * 9.81 / HEIGHT)
    np.testing.assert_allclose(bob["z"], start * np.cos(omega * bob.time_s), atol=2e-6)


def test_a_floating_fish_returns_to_level_in_pitch_and_does_not_resist_roll():
    nose_up = REST.copy()
    nose_up[3], nose_up[5] = np.cos(0.1), np.sin(0.1)
    assert pierced(nose_up, LONG)[4] < -0.1
    rolled = REST.copy()
    rolled[3], rolled[4] = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(pierced(rolled, LONG)[3:], 0.0, atol=1e-15)


def test_all_or_nothing_away_from_the_surface():
    deep, above = REST.copy(), REST.copy()
    deep[2], above[2] = 0.06, -0.06
    assert not pierced(deep, LONG).any()
    np.testing.assert_allclose(pierced(above, LONG), [0, 0, WEIGHT, 0, 0, 0], rtol=1e-12)


def test_other_buoyancy_is_lost_in_the_same_share():
    """Half of a hull that displaces more loses more: effects of displaced mass come first."""
    both = {**SPHERE, "buoyancy_offset": {"mass": 0.5}}
    terms = Simulator(swimmer(), effects=both).wrench_by_term(REST)
    np.testing.assert_allclose(terms["surface_piercing"][2], -0.5 * terms["buoyancy"][2])
