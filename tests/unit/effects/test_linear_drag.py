"""Viscous drag: exponential coasting."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.unit.effects.support import MASS, REST, STILL, in_space, run

EFFECTS = {"linear_drag": {"surge": 0.8, "sway": 1.5, "heave": 2.5}}


@pytest.mark.parametrize(("axis", "drag"), [(0, 0.8), (1, 1.5), (2, 2.5)])
def test_a_fish_coasts_out_exponentially(axis, drag):
    """V = V0 exp(-d t / m) in each direction, with nothing else acting."""
    start = np.eye(3)[axis] * 0.4
    coast = run(EFFECTS, STILL, 3.0, fish=in_space(), velocity_body=tuple(start))
    expected = 0.4 * np.exp(-drag * coast.time_s / MASS)
    np.testing.assert_allclose(coast.states[:, 7 + axis], expected, atol=1e-9)


def test_it_is_drag_through_the_water():
    """At rest in a current it is pushed along."""
    both = {**EFFECTS, "current": {"north": 0.2}}
    push = Simulator(in_space(), effects=both).wrench_by_term(REST)["linear_drag"]
    np.testing.assert_allclose(push, [0.16, 0, 0, 0, 0, 0], atol=1e-15)
