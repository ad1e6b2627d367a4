"""A deflected tail brakes."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import REST

EFFECTS = {"offset_drag": {"coefficient": 8.0}}


@pytest.mark.parametrize(
    ("offset", "speed", "force"), [(0.5, 0.2, -0.08), (-0.5, 0.2, -0.08), (0.25, -0.4, 0.08)]
)
def test_the_force_follows_the_square_of_offset_and_speed(offset, speed, force):
    """-c offset^2 u |u|, against the motion whichever way."""
    state = REST.copy()
    state[7:10] = speed, 0.1, -0.1
    term = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state, [offset, 0.3, 2.0, 0, 0])
    np.testing.assert_allclose(term["offset_drag"], [force, 0, 0, 0, 0, 0], atol=1e-15)


def test_a_straight_tail_does_not_brake():
    """However much it swings."""
    state = REST.copy()
    state[7] = 0.3
    term = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state, [0.0, 0.5, 3.0, 0, 0])
    assert not term["offset_drag"].any()
