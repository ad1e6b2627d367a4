"""Other water: the same as another density and another displaced mass of the fish file."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import ALL_EFFECTS, SWIM, TUMBLE, swimmer
from tests.unit.effects.support import REST, assert_same_motion

SCALE = 1.025
WATER = {"water_density": {"scale": SCALE}}
BESIDE = {**ALL_EFFECTS, "bubbles": {"mass": 0.005, "x": 0.03}}


@pytest.mark.parametrize("beside", [{}, BESIDE], ids=["alone", "beside others"])
def test_it_is_a_fish_in_denser_water(beside):
    """With the virtual mass of the tail, and with displaced mass that other effects add."""
    fish = swimmer()
    scaled = {path: SCALE * fish.get(path) for path in ("water.density", "mass.buoyancy")}
    more = dict(beside)
    if beside:
        more["buoyancy_offset"] = {"mass": SCALE * beside["buoyancy_offset"]["mass"]}
    runs = [
        Simulator(own, effects=effects).run(SWIM, duration_s=2.0, initial=TUMBLE)
        for own, effects in ((fish, {**beside, **WATER}), (fish.replace(scaled), more))
    ]
    assert_same_motion(*runs)
    plain = Simulator(fish, effects=beside).run(SWIM, duration_s=2.0, initial=TUMBLE)
    assert np.abs(plain.states[:, :13] - runs[0].states[:, :13]).max() > 1e-3


def test_every_force_of_the_water_is_proportional_to_it_and_weight_is_not():
    state = REST.copy()
    state[7:13] = 0.3, 0.05, -0.04, 0.2, 0.5, -0.6
    dense = Simulator(swimmer(), effects=WATER).wrench_by_term(state)
    plain = Simulator(swimmer()).wrench_by_term(state)
    for name in plain:
        factor = 1.0 if name in ("gravity", "damping", "inertial") else SCALE
        np.testing.assert_allclose(dense[name], factor * plain[name], rtol=1e-12, err_msg=name)
