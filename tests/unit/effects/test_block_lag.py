"""A lagging block against first-order theory."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import run

LAG = 0.4
EFFECTS = {"block_lag": {"time_constant": LAG}}
STEP = [{"t": 0.0}, {"t": 0.5, "block_displacement": 0.012}]


def test_a_step_is_followed_exponentially():
    """x = dd (1 - exp(-t/T)), and the barycentre with it: dC_m/dx = -m_w/m."""
    moved = run(EFFECTS, STEP, 3.0)
    since = np.maximum(moved.time_s - 0.5, 0.0)
    expected = 0.012 * (1 - np.exp(-since / LAG))
    np.testing.assert_allclose(moved["block_lag.position"], expected, atol=1e-9)
    centre = Simulator(swimmer(), 0.01, EFFECTS).outputs(moved)["barycentre_x"]
    np.testing.assert_allclose(centre, -0.15 * expected, atol=1e-9)


def test_it_starts_where_the_block_was_commanded():
    held = run(EFFECTS, [{"t": 0.0, "block_displacement": -0.008}], 1.0)
    np.testing.assert_allclose(held["block_lag.position"], -0.008, atol=1e-15)


def test_behind_a_scale_it_lags_the_scaled_command():
    """Both effects together: the block ends where the scale puts it."""
    moved = run({**EFFECTS, "block_scale": {"scale": 0.5}}, STEP, 6.0)
    assert moved["block_lag.position"][-1] == pytest.approx(0.006, abs=1e-7)


def test_a_step_longer_than_the_lag_is_divided():
    quick = {"block_lag": {"time_constant": 0.0005}}
    moved = run(quick, STEP, 1.0)
    np.testing.assert_allclose(moved["block_lag.position"][-1], 0.012, atol=1e-9)
    assert Simulator(swimmer(), 0.01, quick).dt <= 0.0005
