"""Random effects over runs: found where they act, absent where they do not, integrated exactly."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.estimate.run_variation import (
    FARTHEST,
    Marginal,
    RunVariation,
    shown_spread,
)
from fish_env.inference.estimate.settle import predicted_variation
from fish_env.inference.estimate.spread import Likelihood, fit_spread
from fish_env.inference.problem import Point
from tests.inference.stated import Numbered, White

RUNS, PER_RUN = 8, 200


def variations(shared):
    return [RunVariation(name, "1", 1.0, shared) for name in ("first", "second")]


def record(seed, spreads=(0.0, 0.0), mean=0.0):
    """Residuals of a linear model whose runs differ in two numbers."""
    rng = np.random.default_rng(seed)
    run_of = np.repeat(np.arange(RUNS), PER_RUN)
    own = rng.standard_normal((RUNS * PER_RUN, 2))
    shared = rng.standard_normal((RUNS * PER_RUN, 3))
    values = rng.standard_normal((RUNS, 2)) * np.asarray(spreads)
    values[:, 1] += mean
    noise = rng.standard_normal(RUNS * PER_RUN)
    residuals = noise + np.einsum("dk,dk->d", own, values[run_of])
    residuals = residuals - shared @ np.linalg.lstsq(shared, residuals, rcond=None)[0]
    return residuals, shared, own, run_of, values


def likelihood(seed, spreads=(0.0, 0.0), mean=0.0, may_share=True):
    residuals, shared, own, run_of, values = record(seed, spreads, mean)
    information = shared.T @ shared + np.eye(3)
    at = np.zeros((RUNS, 2))
    common = np.eye(2)[:, [] if may_share else [0, 1]]
    found = Likelihood(residuals, shared, own, at, run_of, information, np.zeros(3), common)
    return found, values


def test_runs_that_do_not_differ_have_no_spread():
    found = [fit_spread(likelihood(seed)[0], variations(True)).sd for seed in range(40)]
    assert np.mean([sd.any() for sd in found]) <= 0.05


@pytest.mark.parametrize("seed", range(4))
def test_what_differs_is_found_and_what_does_not_is_not(seed):
    own, values = likelihood(seed, (0.0, 1.5))
    found = fit_spread(own, variations(True))
    assert found.sd[0] == 0.0
    assert found.sd[1] == pytest.approx(np.std(values[:, 1]), rel=0.35)
    assert np.all(np.abs(found.values[:, 1] + values[:, 1]) < 4.0 * found.errors[:, 1] + 1e-9)


def test_slope_of_the_likelihood_is_its_derivative():
    own, _ = likelihood(0, (0.5, 1.5), mean=0.3, may_share=False)
    at, step = np.array([0.4, 1.1]), 1e-5
    apart = [at * np.exp(step * unit) for unit in np.vstack([np.eye(2), -np.eye(2)])]
    up, down = np.split(np.array([own(sd) for sd in apart]), 2)
    np.testing.assert_allclose(own.slope(at), (up - down) / (2 * step), rtol=1e-5, atol=1e-4)
    assert own.slope(np.array([0.4, 0.0]))[1] == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_what_all_runs_have_in_common_is_no_variation_unless_it_may_be_shared(seed):
    apart, values = likelihood(seed, (0.0, 0.3), mean=2.0, may_share=False)
    found = fit_spread(apart, variations(False))
    assert found.sd[1] == pytest.approx(np.std(values[:, 1], ddof=1), rel=0.4)
    together, values = likelihood(seed, (0.0, 0.3), mean=2.0)
    found = fit_spread(together, variations(True))
    assert found.sd[1] == pytest.approx(np.sqrt(np.mean(values[:, 1] ** 2)), rel=0.2)


def test_what_runs_share_far_beyond_the_usual_is_left_to_causes():
    far, _ = likelihood(0, (0.0, 0.0), mean=8.0)
    assert fit_spread(far, variations(True)).sd[1] == pytest.approx(1.0)
    near, _ = likelihood(0, (0.0, 0.0), mean=2.0)
    assert fit_spread(near, variations(True)).sd[1] > 1.5


def test_what_differs_by_much_about_something_shared_has_a_large_spread():
    """As do sensors that are fixed anew before every run; but no spread is beyond its limit."""
    far, values = likelihood(0, (0.0, 1.8), mean=8.0)
    assert fit_spread(far, variations(True)).sd[1] == pytest.approx(values[:, 1].std(), rel=0.2)
    wild, _ = likelihood(0, (0.0, 9.0), mean=20.0)
    assert fit_spread(wild, variations(True)).sd[1] == pytest.approx(variations(True)[1].largest)


@pytest.mark.parametrize(("mean", "taken"), [(-1.5, True), (1.5, False)])
def test_what_cannot_be_negative_is_left_out_where_it_would_be(mean, taken):
    """Residuals grow by what the data hold, so the number that puts them right has its sign."""
    late = [RunVariation(name, "1", 1.0, shared=True, positive=True) for name in ("a", "b")]
    found = fit_spread(likelihood(5, (0.0, 0.3), mean=mean)[0], late)
    assert found.sd.any() == taken
    assert not taken or found.values[:, 1].mean() == pytest.approx(-mean, abs=0.4)


def test_the_restricted_likelihood_is_that_of_the_whole_covariance():
    residuals, shared, own, run_of, _ = record(3, (0.4, 0.8))
    sd = np.array([0.4, 0.8])
    design = np.zeros((len(residuals), 2 * RUNS))
    for run in range(RUNS):
        mine = run_of == run
        design[np.ix_(mine, [2 * run, 2 * run + 1])] = own[mine]
    covariance = np.eye(len(residuals)) + (design * np.tile(sd**2, RUNS)) @ design.T
    covariance += shared @ shared.T  # the shared parameters under a standard normal prior
    whole = np.linalg.slogdet(covariance)[1] + residuals @ np.linalg.solve(covariance, residuals)
    plain = np.eye(len(residuals)) + shared @ shared.T
    none = np.linalg.slogdet(plain)[1] + residuals @ np.linalg.solve(plain, residuals)
    tested, _ = likelihood(3, (0.4, 0.8))
    assert tested(sd) - tested(np.zeros(2)) == pytest.approx(whole - none, abs=1e-6)


def test_integrating_out_whitens_by_the_whole_covariance():
    residuals, _, own, run_of, _ = record(1)
    at = np.random.default_rng(0).standard_normal((RUNS, 2))
    marginal = Marginal(0.3 * own, at, run_of)
    shifted = residuals - np.einsum("dk,dk->d", 0.3 * own, at[run_of])
    mine = run_of == 2
    covariance = np.eye(PER_RUN) + 0.09 * own[mine] @ own[mine].T
    expected = shifted[mine] @ np.linalg.solve(covariance, shifted[mine])
    whitened = marginal.residuals(residuals.copy())[mine]
    assert whitened @ whitened == pytest.approx(expected)
    assert marginal.log_det == pytest.approx(
        sum(
            np.linalg.slogdet(np.eye(PER_RUN) + 0.09 * own[run_of == r] @ own[run_of == r].T)[1]
            for r in range(RUNS)
        )
    )


class Growing(Numbered):
    """Runs whose growth differs: far from it the linear model says little."""

    variations = (RunVariation("rate", "1", 1.0),)
    _TIME = np.linspace(0.0, 2.0, 60)

    def __init__(self, rates):
        self.rates = np.asarray(rates)
        self.own = np.zeros((len(rates), 1))
        super().__init__()

    def left(self, z, effects):
        grown = np.exp(np.outer(self.rates, self._TIME))
        return 5.0 * (grown - np.exp(self.own * self._TIME))

    def variation_slopes(self, point, noise, filtered, steps):
        return (-5.0 * self._TIME * np.exp(self.variation * self._TIME)).reshape(-1, 1)


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (2.0,)


def test_a_prediction_of_a_runs_numbers_never_lowers_its_likelihood():
    """The whole step of the linear model does, but for the first, which is near enough."""
    problem, noise, at = Growing([0.02, 0.5, 1.0, 2.0]), Spreading(), Point(np.zeros(1), {})
    moved, _ = predicted_variation(problem, at, noise)

    def worth(one):
        fits = np.array([run.log_likelihood for run in one.filtered(at, noise)])
        return fits - 0.5 * (one.own[:, 0] / noise.spread[0]) ** 2

    assert np.all(worth(moved) >= worth(problem))
    assert moved.own[0, 0] == pytest.approx(0.02, abs=0.002)
    assert np.all(moved.own[1:, 0] > 0.0)


def shown(seed, spread):
    """Spreads shown of numbers that scatter so, seen with half a usual spread of noise."""
    rng = np.random.default_rng(seed)
    variance = 1.0 / (1.0 + 1.0 / 0.5**2)
    seen = spread * rng.standard_normal((RUNS, 4)) + 0.5 * rng.standard_normal((RUNS, 4))
    return shown_spread((1.0 - variance) * seen, np.full((RUNS, 4), variance))


def test_no_prediction_is_farther_than_a_normal_number_may_be():
    """Slopes of a simulation that is about to diverge would lead anywhere."""
    slopes = np.array([[1e-3, 0.0], [0.0, 1.0]])
    marginal = Marginal(slopes, np.zeros((1, 2)), np.zeros(2, int))
    found = marginal.predicted(np.array([-1e12, -4.0]))
    np.testing.assert_allclose(found, [[FARTHEST, 2.0]], rtol=1e-9)
    least = np.zeros(2)
    assert marginal.predicted(np.array([1e12, 1e12]), 0.0, least) == pytest.approx(np.zeros((1, 2)))


def test_spreads_are_told_where_the_data_show_them():
    """And hardly ever where runs do not differ; where the data say nothing, never."""
    assert np.mean([shown(seed, 0.0).any() for seed in range(400)]) <= 0.08
    found = np.array([shown(seed, 2.0) for seed in range(50)])
    assert (found > 0.0).mean() > 0.97
    assert np.sqrt(np.mean(found**2)) == pytest.approx(2.0, rel=0.15)
    assert not shown_spread(np.full((RUNS, 2), 3.0), np.full((RUNS, 2), 0.9)).any()


def test_the_uncertainty_of_own_numbers_is_that_of_their_posterior():
    _, _, own, run_of, _ = record(3)
    marginal = Marginal(0.1 * own, np.zeros((RUNS, 2)), run_of)
    mine = 0.1 * own[run_of == 2]
    exact = np.linalg.inv(mine.T @ mine + np.eye(2))
    assert marginal.uncertainty()[2] == pytest.approx(np.diag(exact))
