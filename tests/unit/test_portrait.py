"""Trim, stability and speeds that `robofish info` shows."""

import numpy as np
import pytest

from fish_env.params import load_fish
from fish_env.simulator import Simulator
from fish_env.studies.portrait import (
    AMPLITUDES_DEG,
    FREQUENCIES_HZ,
    centre_of_mass,
    cruise_speeds,
    static_margins,
    trim_pitch,
    trim_roll,
)
from tests import reference_model

FISH = load_fish("zheng-2021-a")
SIMULATOR = Simulator(FISH)


@pytest.mark.parametrize(("displacement", "angle"), [(0.0, 0.0), (0.012, 0.4), (-0.01, -0.7)])
def test_centre_of_mass_is_that_of_the_equations(displacement: float, angle: float) -> None:
    expected = reference_model.mass_properties(FISH.values(), displacement, angle)[1]
    np.testing.assert_allclose(centre_of_mass(SIMULATOR, displacement, angle), expected, atol=1e-12)


@pytest.mark.parametrize("displacement", [-0.01, 0.0, 0.02])
def test_a_still_fish_comes_to_rest_at_its_trim_pitch(displacement: float) -> None:
    rows = [{"t": 0.0, "block_displacement": displacement}]
    run = SIMULATOR.run(rows, duration_s=60.0)
    assert run["pitch"][-1] == pytest.approx(trim_pitch(SIMULATOR, displacement).angle, abs=1e-4)


def test_a_still_fish_comes_to_rest_at_its_trim_roll() -> None:
    run = SIMULATOR.run([{"t": 0.0, "block_angle": 0.6}], duration_s=60.0)
    assert run["roll"][-1] == pytest.approx(trim_roll(SIMULATOR, 0.6).angle, abs=1e-4)


def test_an_aft_block_raises_the_nose() -> None:
    assert trim_pitch(SIMULATOR, 0.01).angle > 0.0 > trim_pitch(SIMULATOR, -0.01).angle


def test_righting_moment_turns_with_the_depth_of_the_centre_of_mass() -> None:
    margins = static_margins(SIMULATOR)
    assert margins.righting == pytest.approx(2.0 * 9.81 * centre_of_mass(SIMULATOR)[2])
    lifted = Simulator(FISH.replace({"mass.static_moment_rest[2]": -0.02}))
    assert static_margins(lifted).righting < 0.0


def test_margins_have_the_sign_of_the_impact_moments() -> None:
    margins = static_margins(SIMULATOR)
    calm = FISH.replace({"body.plane_xz.impact_moment": -0.05, "body.plane_xy.impact_moment": 0.3})
    other = static_margins(Simulator(calm))
    assert margins.pitch < 0.0 < other.pitch
    assert margins.yaw < other.yaw
    assert np.isfinite(margins.critical_speed)
    assert np.isinf(other.critical_speed)


def test_speeds_grow_with_amplitude_and_frequency() -> None:
    speeds = cruise_speeds(FISH)
    assert speeds.shape == (len(AMPLITUDES_DEG), len(FREQUENCIES_HZ))
    assert (np.diff(speeds, axis=0) > 0).all()
    assert (np.diff(speeds, axis=1) > 0).all()
