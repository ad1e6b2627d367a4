"""The noise floor from data alone."""

import numpy as np
import pytest

from fish_env.data import Dataset
from fish_env.identification.noise import (
    DisturbanceRange,
    disturbance_range,
    fit_noise,
    white_noise_sd,
)
from fish_env.identification.noise_model import NoiseModel
from fish_env.params import load_fish
from tests.identification.synthetic import SENSOR_SD, Setup, simulate

WIDE = DisturbanceRange((1e-4, 5.0), (1e-6, 0.5), (0.05, 30.0))


@pytest.mark.parametrize("channel", ["x", "z", "yaw", "q"])
def test_white_noise_is_an_upper_bound_and_close(channel):
    measured: Dataset = simulate(Setup(runs=4))
    found = white_noise_sd(measured, channel)
    assert 0.85 * SENSOR_SD[channel] < found < 1.6 * SENSOR_SD[channel]


def test_the_search_climbs_to_the_largest_likelihood():
    def peak(noise):
        x = np.log([noise.force_sd / 0.02, noise.moment_sd / 3e-4, noise.correlation_s / 0.4])
        return -50.0 * float(x @ x)

    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(peak, start, WIDE, 80)
    assert found.force_sd == pytest.approx(0.02, rel=0.1)
    assert found.moment_sd == pytest.approx(3e-4, rel=0.1)
    assert found.correlation_s == pytest.approx(0.4, rel=0.1)
    np.testing.assert_array_equal(found.sensor_sd, start.sensor_sd)


def test_where_nothing_is_to_be_gained_it_ends_soon():
    asked = []

    def flat_top(noise):
        asked.append(noise)
        x = np.log([noise.force_sd / 3e-3, noise.moment_sd / 1e-4, noise.correlation_s])
        return -9000.0 - float(x @ x)

    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(flat_top, start, WIDE, 80)
    assert found.force_sd == pytest.approx(3e-3, rel=0.01)
    assert len(asked) <= 20


def test_sensor_noise_only_goes_down_from_its_bound():
    def wants(size):
        return lambda noise: -50.0 * float(np.log(noise.sensor_sd[0] / size) ** 2)

    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    larger = fit_noise(wants(0.01), start, WIDE, 10, start.sensor_sd)
    smaller = fit_noise(wants(0.0008), start, WIDE, 10, start.sensor_sd)
    assert larger.sensor_sd[0] == 0.001
    assert smaller.sensor_sd[0] == pytest.approx(0.0008, rel=0.05)


def test_a_disturbance_does_not_grow_beyond_what_a_tank_makes():
    def grows(noise):
        return 100.0 * float(np.log(noise.force_sd) + np.log(noise.correlation_s))

    within = disturbance_range(load_fish("zheng-2021-a"))
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(grows, start, within, 120)
    assert found.force_sd == pytest.approx(0.0196, rel=0.02)
    assert found.correlation_s == within.correlation[1]
