"""Random effects over runs: found where they act, absent where they do not, integrated exactly."""

import numpy as np
import pytest

from fish_env.inference.estimate.run_variation import Likelihood, Marginal, fit_spread

RUNS, PER_RUN = 8, 200


def record(seed, spreads=(0.0, 0.0)):
    """Residuals of a linear model whose runs differ in two numbers."""
    rng = np.random.default_rng(seed)
    run_of = np.repeat(np.arange(RUNS), PER_RUN)
    own = rng.standard_normal((RUNS * PER_RUN, 2))
    shared = rng.standard_normal((RUNS * PER_RUN, 3))
    values = rng.standard_normal((RUNS, 2)) * np.asarray(spreads)
    noise = rng.standard_normal(RUNS * PER_RUN)
    residuals = noise + np.einsum("dk,dk->d", own, values[run_of])
    residuals = residuals - shared @ np.linalg.lstsq(shared, residuals, rcond=None)[0]
    return residuals, shared, own, run_of, values


def likelihood(seed, spreads=(0.0, 0.0)):
    residuals, shared, own, run_of, values = record(seed, spreads)
    information = shared.T @ shared + np.eye(3)
    at = np.zeros((RUNS, 2))
    return Likelihood(residuals, shared, own, at, run_of, information, np.zeros(3)), values


def test_runs_that_do_not_differ_have_no_spread():
    found = [fit_spread(likelihood(seed)[0], np.ones(2)).sd for seed in range(40)]
    assert np.mean([sd.any() for sd in found]) <= 0.05


@pytest.mark.parametrize("seed", range(4))
def test_what_differs_is_found_and_what_does_not_is_not(seed):
    own, values = likelihood(seed, (0.0, 1.5))
    found = fit_spread(own, np.ones(2))
    assert found.sd[0] == 0.0
    assert found.sd[1] == pytest.approx(np.std(values[:, 1]), rel=0.35)
    assert np.all(np.abs(found.values[:, 1] + values[:, 1]) < 4.0 * found.errors[:, 1] + 1e-9)


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
