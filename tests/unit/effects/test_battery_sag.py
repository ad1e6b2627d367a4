"""A tired battery: the beat slows down with time."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import BEAT, run

EFFECTS = {"battery_sag": {"rate": 0.05}}


def test_the_phase_is_the_integral_of_a_falling_frequency():
    """2 pi f1 (t - rate t^2 / 2)."""
    swim = run(EFFECTS, seconds=4.0)
    t = swim.time_s
    np.testing.assert_allclose(swim["tail_phase"], 4 * np.pi * (t - 0.025 * t**2), atol=1e-10)


def test_an_empty_battery_stands_still():
    """The frequency does not turn negative after 1/rate."""
    phase = run({"battery_sag": {"rate": 0.1}}, seconds=12.0)["tail_phase"]
    assert phase[-1] == pytest.approx(4 * np.pi * 5.0, abs=1e-6)
    assert np.all(np.diff(phase[-90:]) == 0.0)


def test_time_counts_from_the_runs_start_for_samples_of_a_later_part():
    """Time stamps are the run's own clock: a run sampled from 2 s on is already slower there."""
    times = np.array([2.0, 2.5, 3.0])
    part = Simulator(swimmer(), 0.01, EFFECTS).run(BEAT, sample_times_s=times)
    turned = 4 * np.pi * ((times - 2.0) - 0.025 * (times**2 - 4.0))
    np.testing.assert_allclose(part["tail_phase"], turned, atol=1e-10)
