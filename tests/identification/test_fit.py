"""Fits of synthetic runs: values, intervals, noise, files that load, the command line."""

import gymnasium as gym
import numpy as np
import pytest
from scipy.stats import binom
from typer.testing import CliRunner

from fish_env.cli import app
from fish_env.data import write_dataset
from fish_env.errors import EffectError
from fish_env.identification import SeriesProblem, fit, identified_fish
from fish_env.inference.estimate.again import finished
from fish_env.inference.estimate.covariance import sandwich
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.estimate.products import inner
from fish_env.inference.hypotheses import Coefficient, EffectParameterId
from fish_env.inference.problem import Point
from fish_env.params import load_fish, save_fish
from fish_env.simulator import Simulator
from tests.identification.synthetic import FISH, PATHS, Setup, simulate

DATA_SETS = 10


def fish_drawn(rng):
    """Coefficients drawn from their priors."""
    fish = load_fish(FISH)
    return {p: fish.get(p) + fish.prior_sd(p) * rng.standard_normal() for p in PATHS}


@pytest.fixture(scope="module")
def fits():
    """Fits of several data sets, each of another fish, with what was true."""
    found = []
    for seed in range(DATA_SETS):
        changes = fish_drawn(np.random.default_rng(100 + seed))
        setup = Setup(seed=seed, changes=changes)
        found.append((changes, fit(SeriesProblem(simulate(setup), paths=PATHS), rounds=3)))
    return found


def test_intervals_cover(fits):
    hits = sum(
        low <= truth[path] <= high
        for truth, result in fits
        for path in PATHS
        for low, high in [result.interval(Coefficient(path))]
    )
    count = DATA_SETS * len(PATHS)
    assert binom.ppf(0.002, count, 0.95) <= hits
    assert hits > 0.85 * count


def test_the_data_say_more_than_the_prior(fits):
    fish = load_fish(FISH)
    for _, result in fits:
        shares = [np.sqrt(result.covariance[i, i]) / fish.prior_sd(p) for i, p in enumerate(PATHS)]
        assert max(shares) < 1.1  # never shrunk, so chance may widen one that learns nothing
        assert min(shares) < 0.3


def test_the_noise_is_found(fits):
    noises = [result.noise for _, result in fits]
    assert np.median([n.force_sd for n in noises]) == pytest.approx(0.003, rel=0.2)
    assert np.median([n.moment_sd for n in noises]) == pytest.approx(1e-4, rel=0.3)
    assert np.median([n.correlation_s for n in noises]) == pytest.approx(1.0, rel=0.35)


def test_fits_repeat_bit_for_bit():
    setup = Setup(runs=1, duration=3.0)
    results = [fit(SeriesProblem(simulate(setup), paths=PATHS), rounds=2) for _ in range(2)]
    np.testing.assert_array_equal(results[0].estimates, results[1].estimates)


def test_no_interval_shrinks_and_coloured_scores_widen_it():
    rng = np.random.default_rng(0)
    slopes = np.repeat(rng.standard_normal((60, 2)), 25, axis=0)
    times, run = np.arange(1500) / 25.0, np.zeros(1500, np.int64)
    inverse, prior = np.linalg.inv(inner(slopes, slopes)), np.zeros(2)
    white = Linearised(rng.standard_normal(1500), slopes, run, times)
    coloured = Linearised(np.repeat(rng.standard_normal(60), 25), slopes, run, times)
    assert np.all(np.diag(sandwich(white, inverse, prior)) >= np.diag(inverse) * (1 - 1e-12))
    ratio = np.diag(sandwich(coloured, inverse, prior)) / np.diag(inverse)
    assert np.all(ratio > 8.0)


def fit_to_runs_that_err(by, rng, parameters, samples, runs=6):
    """Estimates (n,) of zero, their variances and those in white residuals.

    The first parameter is a gain, of which each run has an error of its own.
    """
    slopes = rng.standard_normal((runs * samples, parameters))
    run, times = np.repeat(np.arange(runs), samples), np.tile(np.arange(samples) / 25.0, runs)
    own = (by * rng.standard_normal(runs))[run]
    error = slopes[:, 0] * own + rng.standard_normal(len(run))
    inverse = np.linalg.inv(inner(slopes, slopes))
    estimates = inverse @ (slopes.T @ error)
    lin = Linearised(error - slopes @ estimates, slopes, run, times)
    return estimates, np.diag(sandwich(lin, inverse, np.zeros(parameters))), np.diag(inverse)


def test_runs_that_err_as_a_whole_widen_what_they_disagree_on():
    """A tail of another gain in each run: the gain is known only as well as runs agree on it."""
    fits = [fit_to_runs_that_err(0.2, np.random.default_rng(i), 2, 750) for i in range(20)]
    ratios = np.array([variances / white for _, variances, white in fits])
    assert np.median(ratios[:, 0]) > 15.0
    assert np.median(ratios[:, 1]) < 2.0


def test_an_interval_over_runs_that_err_alike_holds_the_truth():
    """In most data sets: in so few runs their errors do not always show."""
    fits = [fit_to_runs_that_err(0.3, np.random.default_rng(i), 1, 200) for i in range(400)]
    held = [abs(estimates[0]) < 1.96 * np.sqrt(variances[0]) for estimates, variances, _ in fits]
    assert np.mean(held) > 0.92


def test_products_in_blocks_are_the_products():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((1000, 3)), rng.standard_normal((1000, 2))
    np.testing.assert_allclose(inner(a, b), a.T @ b, atol=1e-11)
    np.testing.assert_allclose(inner(a[:10], b[:10]), a[:10].T @ b[:10], atol=1e-12)


def test_unknown_effects_are_refused():
    with pytest.raises(EffectError, match="known: "):
        SeriesProblem(simulate(Setup(runs=1, duration=1.0)), effects=["tail_wobble"])


def test_an_effect_that_is_off_at_infinity_begins_at_a_mild_size():
    """No rate limit at all has no slope to follow; a tail that it does not hold back has none."""
    problem = SeriesProblem(
        simulate(Setup(runs=1, duration=4.0)), paths=PATHS, effects=["servo_rate_limit"]
    )
    assert problem.start.effects == {EffectParameterId("servo_rate_limit", "rate"): 8.0}
    found = fit(problem, rounds=1, iterations=2)
    assert np.isfinite(found.objective)
    assert found.point.effects[EffectParameterId("servo_rate_limit", "rate")] > 3.0


def test_default_noise_keeps_what_the_dataset_says():
    problem = SeriesProblem(simulate(Setup(runs=1, duration=1.0)), paths=PATHS)
    np.testing.assert_array_equal(problem.default_noise().sensor_sd, Setup().noise.sensor_sd)


def test_a_fit_becomes_a_fish_that_loads(fits, tmp_path):
    result = fits[0][1]
    file = tmp_path / "identified.yaml"
    save_fish(identified_fish(result, "identified"), file)
    fish = load_fish(file)
    assert fish.info(PATHS[0]).status == "identified"
    assert fish.get(PATHS[0]) == result.estimates[0]
    assert fish.posterior is not None
    np.testing.assert_allclose(fish.posterior.covariance, result.covariance, rtol=1e-9)
    assert fish.posterior.validity["ranges"]["tail_frequency"][1] <= 2.2
    Simulator(str(file)).run([{"t": 0.0}], duration_s=0.1)
    env = gym.make("RoboticFish3D-v0", fish=str(file), randomization="posterior")
    env.reset(seed=0)


def test_the_command_fits_and_writes(tmp_path):
    write_dataset(simulate(Setup(runs=1, duration=4.0)), tmp_path / "trials")
    out = tmp_path / "found" / "identified.yaml"
    result = CliRunner().invoke(app, ["fit", str(tmp_path / "trials"), "--out", str(out)])
    assert result.exit_code == 0, result.output
    for words in ("95 %", "disturbance found", "condition number", "written"):
        assert words in result.output
    assert load_fish(out).name == "identified"


def test_a_fit_that_was_cut_short_is_taken_on_until_it_rests():
    problem = SeriesProblem(simulate(Setup(seed=3, runs=2, duration=6.0)), paths=PATHS)
    short = fit(problem, rounds=1, iterations=1, start=Point(np.full(len(PATHS), 1.5), {}))
    rested = finished(short)
    assert rested.objective < short.objective - 1.0
    assert finished(rested).objective == pytest.approx(rested.objective, abs=0.25)
    through = fit(problem, rounds=6, start=Point(np.full(len(PATHS), 1.5), {}))
    # Each has a noise model of its own, which its last alternation left.
    assert rested.objective == pytest.approx(through.objective, abs=3.0)
