"""A displaced centre of mass: trim in closed form."""

import numpy as np
import pytest

from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import run

CENTRE_Z = 0.006


def centre_height():
    """z of fish A's barycentre (m)."""
    simulator = Simulator(swimmer())
    rest = simulator.run([{"t": 0.0}], 0.1, InitialState())
    return simulator.outputs(rest)["barycentre_z"][0]


def test_a_resting_fish_pitches_and_rolls_until_its_mass_hangs_below():
    """tan(pitch) = -x / sqrt(y^2 + z^2), tan(roll) = y / z."""
    x, y, z = 0.001, 0.0006, 0.0004
    effects = {"com_offset": {"x": x, "y": y, "z": z}}
    end = run(effects, [{"t": 0.0}], 30.0, dt=0.02, rate_hz=2.0)
    low = centre_height() + z
    assert end["pitch"][-1] == pytest.approx(-np.arctan2(x, np.hypot(y, low)), abs=1e-3)
    assert end["roll"][-1] == pytest.approx(np.arctan2(y, low), abs=1e-3)


def test_it_shifts_the_barycentre_and_what_hangs_on_it():
    """Weight keeps its size and gains a moment; the accelerations follow the shifted centre."""
    effects = {"com_offset": {"x": 0.001}}
    rest = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], float)
    shifted = Simulator(swimmer(), effects=effects).wrench_by_term(rest)["gravity"]
    plain = Simulator(swimmer()).wrench_by_term(rest)["gravity"]
    np.testing.assert_allclose(shifted[:3], plain[:3])
    np.testing.assert_allclose(shifted[3:] - plain[3:], [0, -0.001 * 2.0 * 9.81, 0], atol=1e-15)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_largest_allowed_offset_leaves_a_mass_matrix_that_can_be_solved(sign):
    """J about O_b stays, so a far centre of mass would make it indefinite."""
    effects = {"com_offset": dict.fromkeys("xyz", 0.02 * sign)}
    assert np.isfinite(run(effects, [{"t": 0.0}], 2.0).states).all()
