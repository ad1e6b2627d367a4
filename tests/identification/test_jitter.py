"""Samples that are taken early or late: a noise that grows with how fast channels change."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification import SeriesProblem, fit
from fish_env.identification.jitter import channel_rates
from fish_env.identification.noise import fitted_noise
from fish_env.identification.sensors import largest_jitter_of
from tests.identification.synthetic import PATHS, Setup, simulate


def found_in(setup: Setup, **noise):
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    start = replace(setup.noise, jitter_sd=0.0, **noise)
    return fitted_noise(problem, range(problem.run_count), problem.start, start, None)


def test_rates_are_those_of_the_channels():
    clock = np.arange(200) / 25.0
    angle = 3.0 * clock
    wound = np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
    measured = np.column_stack([np.sin(2.0 * clock), wound])
    measured[50:53] = np.nan
    rates = channel_rates(clock, measured, ("x", "yaw"))
    told = np.r_[1:48, 55:199]
    np.testing.assert_allclose(rates[told, 0], 2.0 * np.cos(2.0 * clock[told]), atol=0.01)
    np.testing.assert_allclose(rates[:, 1], 3.0)


def test_a_channel_never_measured_has_no_rate():
    clock = np.arange(5) / 25.0
    assert not channel_rates(clock, np.full((5, 1), np.nan), ("x",)).any()


@pytest.mark.parametrize("jitter_sd", [0.002, 0.005])
def test_jitter_of_the_sample_times_is_found(jitter_sd):
    found = found_in(Setup(runs=4, jitter_sd=jitter_sd))
    assert found.jitter_sd == pytest.approx(jitter_sd, rel=0.2)
    assert found.force_sd < 2.0 * Setup().force_sd
    assert found.moment_sd < 2.0 * Setup().moment_sd


@pytest.mark.parametrize("seed", range(4))
def test_samples_taken_in_time_have_none(seed):
    assert found_in(Setup(runs=4, seed=seed)).jitter_sd == 0.0


def test_a_wrong_fish_does_not_pass_for_jitter():
    setup = Setup(runs=4, changes={"tail.lift.c1": 3.4})
    found = fit(SeriesProblem(simulate(setup), paths=PATHS), rounds=3)
    assert found.noise.jitter_sd == 0.0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("jitter_sd", [0.002, 0.005])
def test_the_series_themselves_bound_it(seed, jitter_sd):
    bound = largest_jitter_of(simulate(Setup(seed=seed, runs=4, jitter_sd=jitter_sd)))
    assert 0.8 * jitter_sd < bound < 2.0 * jitter_sd


def test_no_series_is_no_bound():
    data = simulate(Setup(runs=1, duration=1.0))
    assert largest_jitter_of(data) == np.inf
