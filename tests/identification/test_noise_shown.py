"""Declared noise that the samples do not bear out."""

from dataclasses import replace

import pytest

from fish_env.identification.sensors import noise_over_declared, with_noise_shown
from tests.identification.synthetic import Setup, simulate


def declared(times: float, **setup):
    """Runs whose dataset declares so many times the true noise of each channel."""
    data = simulate(Setup(runs=3, **setup))
    return replace(data, noise={name: times * sd for name, sd in data.noise.items()})


@pytest.mark.parametrize("seed", range(4))
def test_noise_as_declared_stays(seed):
    data = declared(1.0, seed=seed)
    assert with_noise_shown(data) is data


def test_noise_that_is_declared_too_large_stays():
    data = declared(3.0)
    assert with_noise_shown(data) is data


def test_samples_that_scatter_more_than_declared_say_how_much():
    data = declared(0.6)
    shown = with_noise_shown(data)
    assert noise_over_declared(data) == pytest.approx(1.0 / 0.6, rel=0.1)
    said = f"{noise_over_declared(data):.2g} times"
    assert any(said in note for note in shown.notes), shown.notes
    for name, sd in shown.noise.items():
        true = data.noise[name] / 0.6
        assert 0.85 * true < sd < 1.8 * true, name  # motion that is not smooth adds to it


def test_one_noisy_channel_is_no_case():
    data = declared(1.0)
    data = replace(data, noise={**data.noise, "yaw": 0.5 * data.noise["yaw"]})
    assert with_noise_shown(data) is data


def test_few_channels_are_no_case():
    data = declared(0.6, channels=("x", "yaw"))
    assert with_noise_shown(data) is data
