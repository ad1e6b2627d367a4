"""The linkage that shifts the weight block."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fish_env.errors import ScheduleError
from fish_env.model.crank_slider import CrankSlider
from fish_env.simulator import Simulator

CRANK = CrankSlider(0.022, 0.030)


@given(angle=st.floats(0.0, np.pi))
def test_angle_to_displacement_and_back(angle):
    """Both directions agree over the half turn that the motor uses."""
    back = CRANK.motor_angle(CRANK.displacement(angle))
    # At the dead centres the displacement says nothing about small angles.
    assert CRANK.displacement(back) == pytest.approx(CRANK.displacement(angle), abs=1e-15)
    assert back == pytest.approx(angle, abs=1e-7)


@given(share=st.floats(0.0, 1.0), l2=st.floats(0.0221, 0.3))
def test_displacement_to_angle_and_back(share, l2):
    """Any linkage, the whole reach, ends included."""
    crank = CrankSlider(0.022, l2)
    low, high = crank.reach
    displacement = low + share * (high - low)
    assert crank.displacement(crank.motor_angle(displacement)) == pytest.approx(
        displacement, abs=1e-14
    )


def test_a_quarter_turn_is_the_rest_position():
    """s_w up to the constant that makes xi3 = pi/2 zero displacement."""
    assert CRANK.displacement(np.pi / 2) == pytest.approx(0.0, abs=1e-17)
    assert CRANK.motor_angle(0.0) == pytest.approx(np.pi / 2)


def test_the_slider_follows_the_geometry():
    """Crank pin at l1 (cos, sin), the rod l2 long from there to the slider on the axis."""
    angle = np.linspace(0, np.pi, 50)
    slider = CRANK.displacement(angle) + CRANK.rest
    pin = 0.022 * np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(np.hypot(slider - pin[0], pin[1]), 0.030, rtol=1e-14)


def test_the_reach_is_that_of_the_stretched_and_folded_linkage():
    low, high = CRANK.reach
    assert high - low == pytest.approx(2 * 0.022)
    assert (CRANK.displacement(np.pi), CRANK.displacement(0.0)) == pytest.approx((low, high))
    assert np.all(np.diff(CRANK.displacement(np.linspace(0, np.pi, 100))) < 0)


@pytest.mark.parametrize("displacement", [-0.02, 0.04, np.nan, [0.0, 0.05]])
def test_a_displacement_beyond_reach_is_refused_with_the_reach(displacement):
    with pytest.raises(ScheduleError, match=r"beyond the crank's reach.*-0\.0124 and 0\.0316"):
        CRANK.motor_angle(displacement)


def test_the_simulator_warns_of_a_displacement_beyond_reach_and_simulates_it():
    simulator = Simulator("zheng-2021-a")
    assert simulator.crank == CRANK
    with pytest.warns(UserWarning, match=r"block displacement -0\.015 m is beyond"):
        run = simulator.run([{"t": 0.0, "block_displacement": -0.015}], duration_s=0.1)
    assert run["block_displacement"][0] == -0.015
