"""The noise floor from data alone."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.data import Dataset
from fish_env.identification.noise import (
    DisturbanceRange,
    disturbance_range,
    fit_noise,
    fitted_noise,
    white_noise_sd,
)
from fish_env.identification.noise_information import products_of_changes
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.noise_scoring import Replayed, System
from fish_env.identification.series import SeriesProblem
from fish_env.inference.policy import POLICY
from fish_env.params import load_fish
from tests.identification.synthetic import PATHS, SENSOR_SD, Setup, simulate

WIDE = DisturbanceRange((1e-4, 5.0), (1e-6, 0.5), (0.05, 30.0))


@pytest.mark.parametrize("channel", ["x", "z", "yaw", "q"])
def test_white_noise_is_an_upper_bound_and_close(channel):
    measured: Dataset = simulate(Setup(runs=4))
    found = white_noise_sd(measured, channel)
    assert 0.85 * SENSOR_SD[channel] < found < 1.6 * SENSOR_SD[channel]


def three_sizes(noise):
    """Standard deviations that a toy's innovations have under a noise model."""
    return np.array([noise.force_sd, noise.moment_sd, noise.correlation_s])


def toy(rms, sizes=three_sizes, asked=None):
    """What a noise model makes of innovations of known size: likeliest is the one that has it."""
    values = np.asarray(rms) * np.where(np.arange(400) % 2, 1.0, -1.0)[:, None]

    def replay(noise):
        if asked is not None:
            asked.append(noise)
        sd = sizes(noise)
        white = values / sd
        value = -0.5 * np.sum(white**2) - len(values) * np.sum(np.log(sd))
        return Replayed(
            float(value), white, np.broadcast_to(np.diag(1.0 / sd), (400, *[len(sd)] * 2))
        )

    return replay


@pytest.mark.parametrize("wanted", [(0.02, 3e-4, 0.4), (2e-4, 2e-6, 20.0), (1.0, 0.1, 0.1)])
def test_the_search_climbs_to_the_largest_likelihood(wanted):
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(toy(wanted), start, WIDE)
    np.testing.assert_allclose(three_sizes(found), wanted, rtol=0.03)
    np.testing.assert_array_equal(found.sensor_sd, start.sensor_sd)


def test_where_nothing_is_to_be_gained_it_ends_soon():
    asked: list[NoiseModel] = []
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(toy((3e-3, 1e-4, 1.0), asked=asked), start, WIDE)
    assert found.force_sd == pytest.approx(3e-3, rel=0.01)
    assert len(asked) <= 5


def test_a_disturbance_that_belongs_beyond_its_bound_is_known_at_once():
    """Where all the other numbers would be the likeliest is then of no use."""
    asked: list[NoiseModel] = []
    most = disturbance_range(load_fish("msu-tail-fish"))
    start = NoiseModel(np.array([0.001]), most.force[1], 1e-4, 1.0)
    found = fit_noise(toy((1.0, 1e-4, 1.0), asked=asked), start, most, to_the_end=False)
    assert found.force_sd == pytest.approx(start.force_sd)
    assert len(asked) == 2


def test_beside_a_simulation_that_diverges_the_noise_stays_as_it_is():
    """And nothing is printed about numbers that overflow."""
    start, plain = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0), toy((0.02, 3e-4, 0.4))

    def diverging(noise):
        seen = plain(noise)
        return replace(seen, innovations=1e200 * seen.innovations)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fit_noise(diverging, start, WIDE)
    assert three_sizes(found) == pytest.approx(three_sizes(start))


def test_sensor_noise_only_goes_down_from_its_bound():
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)

    def of(size):
        replay = toy([size], lambda noise: noise.sensor_sd)
        return fit_noise(replay, start, WIDE, start.sensor_sd).sensor_sd[0]

    assert of(0.01) == 0.001
    assert of(0.0008) == pytest.approx(0.0008, rel=0.01)


def test_no_disturbance_makes_a_sensor_exact():
    """One that follows a channel through every sample would have the noise vanish."""
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    replay = toy([1e-9], lambda noise: noise.sensor_sd)
    found = fit_noise(replay, start, WIDE, start.sensor_sd).sensor_sd[0]
    assert found == pytest.approx(POLICY.least_sensor_share * 0.001)


def test_a_disturbance_does_not_grow_beyond_what_a_tank_makes():
    within = disturbance_range(load_fish("zheng-2021-a"))
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    found = fit_noise(toy((5.0, 1e-4, 100.0)), start, within)
    assert found.force_sd == within.force[1]
    assert found.moment_sd == pytest.approx(1e-4, rel=0.03)
    assert found.correlation_s == within.correlation[1]


def test_no_number_of_the_disturbance_could_be_better():
    """On a real filter: a little more or less of any has a smaller likelihood."""
    setup = Setup(runs=4)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    filtered = problem.filtered(problem.start, setup.noise, keep_slopes=True)

    def replay(noise):
        return problem.lean_filter.replay(filtered, setup.noise, noise)

    found = fit_noise(replay, replace(setup.noise, force_sd=0.01, correlation_s=0.2), WIDE)
    best = replay(found).log_likelihood
    for name in ("force_sd", "moment_sd", "correlation_s"):
        for factor in (0.8, 1.25):
            other = replace(found, **{name: factor * getattr(found, name)})
            assert replay(other).log_likelihood < best


def test_a_disturbance_that_never_ends_is_a_misfit_with_another_name():
    within = disturbance_range(load_fish("zheng-2021-a"))
    felt = NoiseModel(np.array([0.001]), 0.4 * within.force[1], 1e-5, within.correlation[1])
    assert any("stays for 10 s" in words for words in within.left_by(felt))
    assert not within.left_by(replace(felt, correlation_s=2.0))
    faint = replace(felt, force_sd=0.02 * within.force[1])
    assert not within.left_by(faint), "how long a faint one lasts no run tells"


class ToyRuns:
    """Toy runs: what a noise model makes of them along one motion, and filtered anew."""

    fish = load_fish("zheng-2021-a")
    largest_jitter_s = 0.0

    def __init__(self, wanted, filter_anew):
        self.along = toy(wanted)
        self.lean_filter = SimpleNamespace(replay=lambda runs, made_with, noise: self.along(noise))
        self.filter_anew = filter_anew

    def some(self, runs):
        return self

    def filtered(self, point, noise, near=(), keep_slopes=False):
        return self.filter_anew(self, noise)


@pytest.mark.parametrize("lost", ["less likely", "diverged"])
def test_a_noise_model_under_which_runs_lose_a_beat_is_not_taken(lost):
    """A replay cannot know it: the likeliest noise model on the way that keeps them is."""
    start = NoiseModel(np.array([0.001]), 3e-3, 1e-4, 1.0)
    wanted = (0.015, 3e-4, 0.4)

    def filtered(runs, noise):
        if noise.force_sd > 0.01:
            if lost == "diverged":
                raise np.linalg.LinAlgError
            return [SimpleNamespace(log_likelihood=-1e9, slopes=())]
        return [SimpleNamespace(log_likelihood=runs.along(noise).log_likelihood, slopes=())]

    losing = ToyRuns(wanted, filtered)
    found = fitted_noise(losing, [0], None, start, None)
    assert start.force_sd < found.force_sd <= 0.01
    assert losing.along(found).log_likelihood > losing.along(start).log_likelihood
    keeping = ToyRuns(wanted, lambda runs, noise: [SimpleNamespace(log_likelihood=0.0, slopes=())])
    np.testing.assert_allclose(
        three_sizes(fitted_noise(keeping, [0], None, start, None)), wanted, rtol=0.03
    )


def test_curvature_that_the_information_leaves_out_is_learnt():
    """After as many steps as there are parameters a quadratic's whole curvature is known."""
    rng = np.random.default_rng(4)
    whole = np.diag([3.0, 2.0, 1.0, 0.5]) + 0.1
    system = System(np.zeros(4), np.eye(4), np.eye(4))
    unseen = np.zeros((4, 4))
    for step in rng.standard_normal((4, 4)):
        unseen = system.unseen(unseen, step, whole @ step)
        np.testing.assert_allclose((system.average + unseen) @ step, whole @ step, atol=1e-9)
    np.testing.assert_allclose(system.average + unseen, whole, atol=1e-6)
    assert system.believes(unseen)
    assert not system.believes(-np.eye(4)), "nothing rises towards a minimum"
    again = system.unseen(unseen, step, whole @ step)
    np.testing.assert_allclose(again, unseen, atol=1e-9, err_msg="nothing is left to learn")


def test_products_of_changes_are_those_of_arrays():
    """As arrays: changes in the whitened coordinates of the present noise model, then products."""
    rng, samples, channels = np.random.default_rng(0), 40, 4
    by = np.array([1e-3, -1e-3, 1e-3])
    here = rng.standard_normal((samples, channels))
    factors = np.eye(channels) + 0.2 * np.tril(rng.standard_normal((samples, channels, channels)))
    there = here + 1e-3 * rng.standard_normal((3, *here.shape))
    moved = factors + 1e-3 * np.tril(rng.standard_normal((3, *factors.shape)))
    found = [np.zeros((3, 3)) for _ in range(3)]
    products_of_changes(here, factors, there, moved, by, *found)

    back = (np.eye(channels) - moved @ np.linalg.inv(factors)) / by[:, None, None, None]
    mean = (there - here) / by[:, None, None] + np.einsum("mtij,mtj->mti", back, there)
    spread = back + back.swapaxes(2, 3)
    seen = np.einsum("mtij,tj->mti", spread, here)
    for products, changes in zip(found, (mean, spread, seen), strict=True):
        rows = changes.reshape(3, -1)
        np.testing.assert_allclose(products, rows @ rows.T, rtol=1e-9)
