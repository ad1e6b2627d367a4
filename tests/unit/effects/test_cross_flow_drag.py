"""Cross-flow drag: hyperbolic decay sideways and vertically, nothing ahead."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.unit.effects.support import MASS, REST, STILL, in_space, run

EFFECTS = {"cross_flow_drag": {"sway": 6.0, "heave": 9.0}}


@pytest.mark.parametrize(("axis", "drag"), [(1, 6.0), (2, 9.0)])
def test_a_sideslip_dies_out_like_one_over_time(axis, drag):
    """v = v0 / (1 + c v0 t / m), either way."""
    for sense in (1.0, -1.0):
        start = np.eye(3)[axis] * 0.3 * sense
        slip = run(EFFECTS, STILL, 3.0, fish=in_space(), velocity_body=tuple(start))
        expected = 0.3 * sense / (1 + drag * 0.3 * slip.time_s / MASS)
        np.testing.assert_allclose(slip.states[:, 7 + axis], expected, atol=1e-9)


def test_the_speed_ahead_does_not_matter():
    """Neither is it braked, nor does it change the force across."""
    simulator = Simulator(in_space(), effects=EFFECTS)
    slow, fast = REST.copy(), REST.copy()
    slow[7:10], fast[7:10] = (0.0, 0.1, -0.2), (0.5, 0.1, -0.2)
    forces = [simulator.wrench_by_term(state)["cross_flow_drag"] for state in (slow, fast)]
    np.testing.assert_array_equal(forces[0], forces[1])
    np.testing.assert_allclose(forces[0][:3], [0.0, -0.06, 0.36], atol=1e-15)
