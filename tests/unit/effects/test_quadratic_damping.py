"""Quadratic damping of rotation: hyperbolic decay."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import mass_matrix
from tests.unit.effects.support import REST, STILL, in_space, run

EFFECTS = {"quadratic_damping": {"roll": 0.004, "pitch": 0.01, "yaw": 0.006}}


@pytest.mark.parametrize(("axis", "damping"), [(0, 0.004), (1, 0.01), (2, 0.006)])
def test_a_spin_dies_out_like_one_over_time(axis, damping):
    """omega = omega0 / (1 + c omega0 t / J) about a principal axis."""
    for sense in (1.0, -1.0):
        start = np.eye(3)[axis] * 2.0 * sense
        spin = run(EFFECTS, STILL, 3.0, fish=in_space(), angular_velocity_body=tuple(start))
        inertia = mass_matrix(in_space(), np.zeros(5))[3 + axis, 3 + axis]
        expected = 2.0 * sense / (1 + damping * 2.0 * spin.time_s / inertia)
        np.testing.assert_allclose(spin.states[:, 10 + axis], expected, atol=1e-6)


def test_it_takes_power_in_every_rotation():
    rng = np.random.default_rng(1)
    simulator = Simulator(in_space(), effects=EFFECTS)
    for spin in rng.normal(size=(20, 3)):
        state = np.concatenate([REST[:10], spin])
        moment = simulator.wrench_by_term(state)["quadratic_damping"]
        assert not moment[:3].any()
        assert moment[3:] @ spin < 0
