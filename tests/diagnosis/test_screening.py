"""Screening on a linear problem, where the right answers are known."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import kstest

from fish_env.identification import SeriesProblem, fit
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.probes import Cause, best_of_each, causes_of, coefficient_sizes
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import confusability, null_threshold, screen, smallest_detectable
from fish_env.params import load_fish
from tests.diagnosis.linear import COEFFICIENTS, LinearProblem
from tests.identification.synthetic import FISH, PATHS, Setup, simulate

PROBLEM = LinearProblem()


def signals(fit, problem=PROBLEM):
    projector = Projector(fit)
    pairs = zip(problem.causes, problem.columns, strict=True)
    return [projector.signal(cause, 0, columns) for cause, columns in pairs]


def alarms(problem, threshold, repeats=400, corrected=True, **data):
    """Share of data sets in which some p-value falls below the threshold."""
    rng, found = np.random.default_rng(5), 0
    for _ in range(repeats):
        tested = signals(problem.fit(rng, **data), problem)
        if not corrected:
            tested = [replace(s, variance_inflation=1.0) for s in tested]
        found += min(s.log_p for s in tested) < threshold
    return found / repeats


def threshold_of(problem, level=0.05):
    rng = np.random.default_rng(1)
    return null_threshold(signals(problem.fit(rng), problem), rng, level)


def test_a_signal_keeps_what_the_coefficients_cannot_follow():
    """Its information is the Schur complement of the joint information, priors included."""
    fit = PROBLEM.fit(np.random.default_rng(0))
    slopes, column = PROBLEM.slopes, PROBLEM.columns[0]
    inverse = np.linalg.inv(slopes.T @ slopes + np.eye(COEFFICIENTS))
    expected = column.T @ column - column.T @ slopes @ inverse @ slopes.T @ column
    signal = Projector(fit).signal(PROBLEM.causes[0], 0, column)
    assert signal.projected == pytest.approx(expected, rel=1e-6)
    assert 0.2 < signal.absorbed_share < 0.5


def test_settings_that_do_the_same_have_a_threshold_whatever_rounding_makes_of_them():
    """Their products in 32 bits need not be those of any signals."""
    two = LinearProblem(settings=2)
    tested = signals(two.fit(np.random.default_rng(0)), two)
    products = np.kron(np.eye(len(tested)), np.full((2, 2), 1.0 + 1e-7) - 1e-7 * np.eye(2))
    assert np.linalg.eigvalsh(products)[0] < 0.0
    found = null_threshold(tested, np.random.default_rng(1), 0.05, products=products)
    one = null_threshold(signals(PROBLEM.fit(np.random.default_rng(0))), np.random.default_rng(1),
                         0.05, products=np.eye(len(tested)))  # fmt: skip
    assert one < found < 0.5 * one  # one degree of freedom, judged as two


def test_a_signal_that_the_coefficients_can_follow_is_absorbed():
    fit = PROBLEM.fit(np.random.default_rng(0))
    own = Projector(fit).signal(PROBLEM.causes[0], 0, PROBLEM.slopes[:, [1]])
    other = Projector(fit).signal(PROBLEM.causes[0], 0, np.random.default_rng(9).normal(
        size=(PROBLEM.size, 1)
    ))  # fmt: skip
    assert own.absorbed_share > 0.99
    assert other.absorbed_share < 0.05
    assert Projector(fit).signal(PROBLEM.causes[0], 0, np.zeros((PROBLEM.size, 1))) is None


def test_signals_at_once_are_those_one_by_one_and_a_diverged_one_spoils_no_other():
    fit = PROBLEM.fit(np.random.default_rng(2))
    widths = [columns.shape[1] for columns in PROBLEM.columns]
    ends = np.cumsum(widths)
    own = [list(range(end - width, end)) for end, width in zip(ends, widths, strict=True)]
    rows = np.concatenate([columns.T for columns in PROBLEM.columns])
    rows[own[1][0], 5] = np.nan
    tests = [(cause, 0, part) for cause, part in zip(PROBLEM.causes, own, strict=True)]
    found, alone = Projector(fit).signals(tests, rows), signals(fit)
    assert found[1] is None
    for i in (0, *range(2, len(alone))):
        np.testing.assert_allclose(found[i].left, alone[i].left, atol=1e-12)
        assert found[i].statistic == pytest.approx(alone[i].statistic, rel=1e-9)


def test_what_a_bound_holds_back_hides_no_cause():
    """A cause like a coefficient that has gone as far as it may is all that can still explain."""
    column = PROBLEM.slopes[:, [1]] + 0.01 * PROBLEM.columns[0]
    data = np.random.default_rng(3)
    fit = PROBLEM.fit(data, added=6.0 * column[:, 0], reach=2.0)
    assert fit.point.z[1] == pytest.approx(-2.0)
    np.testing.assert_array_equal(fit.active, np.eye(COEFFICIENTS)[[1]])
    signal = Projector(fit).signal(PROBLEM.causes[0], 0, column)
    # Without the coefficient that is held, the cause in its place.
    free = np.column_stack([np.delete(PROBLEM.slopes, 1, axis=1), column])
    prior = np.diag(np.r_[np.ones(COEFFICIENTS - 1), 0.0])
    pull = free.T @ fit.linearised.residuals + prior @ np.r_[np.delete(fit.point.z, 1), 0.0]
    gain = pull @ np.linalg.solve(free.T @ free + prior, pull)
    assert signal.uncorrected == pytest.approx(gain, rel=1e-5)
    unheld = replace(fit, active=fit.active[:0])
    assert Projector(unheld).signal(PROBLEM.causes[0], 0, column).uncorrected < 0.01 * gain


def test_a_coefficient_at_its_bound_counts_with_where_it_would_go():
    """Far off, the one that is wrong stands out; at the same bound, all look alike."""
    added, rng = 6.0 * PROBLEM.slopes[:, 1], np.random.default_rng(3)
    bounded = PROBLEM.fit(rng, added=added, reach=2.0)
    unbounded = PROBLEM.fit(np.random.default_rng(3), added=added)
    for i in range(COEFFICIENTS):
        at, variance = Projector(bounded).without_own_bound(i)
        free_at, free_variance = Projector(unbounded).without_own_bound(i)
        if i == 1:
            assert (at, variance) == pytest.approx((free_at, free_variance))
        else:
            assert at == bounded.point.z[i]


@pytest.mark.parametrize("settings", [1, 3])
def test_p_values_are_uniform_where_nothing_is_wrong(settings):
    """With prior draws of the coefficients and white noise; too narrow a spread would be seen."""
    problem = LinearProblem(signals=1, settings=settings)
    rng, values = np.random.default_rng(2), []
    for _ in range(500):
        signal = signals(problem.fit(rng), problem)[0]
        values.append(np.exp(replace(signal, variance_inflation=1.0).log_p))
    assert kstest(values, "uniform").pvalue > 0.01
    assert kstest(np.array(values) ** 1.5, "uniform").pvalue < 0.01


def test_false_alarms_keep_to_the_level_over_all_causes_together():
    threshold = threshold_of(PROBLEM)
    assert np.log(0.05 / len(PROBLEM.causes)) <= threshold < np.log(0.05)
    assert 0.01 < alarms(PROBLEM, threshold) < 0.08
    assert alarms(PROBLEM, np.log(0.05)) > 0.1  # each cause at the level by itself


def test_causes_that_are_alike_cost_less_than_different_ones():
    alike = LinearProblem(signals=1)
    alike.columns, alike.causes = alike.columns * 6, alike.causes * 6
    assert threshold_of(alike) == pytest.approx(np.log(0.05), abs=0.15)
    assert threshold_of(alike) > threshold_of(PROBLEM) + 0.5


def test_coloured_residuals_raise_fewer_alarms_than_an_uncorrected_test():
    """Slow signals and slow residuals are what makes an uncorrected test see ghosts."""
    problem = LinearProblem(signals=4)
    problem.columns = [np.cumsum(c, axis=0) / 10 for c in problem.columns]
    problem.columns = [c - c.mean() for c in problem.columns]
    threshold = threshold_of(problem)
    plain = alarms(problem, threshold, 150, corrected=False, memory=0.8)
    corrected = alarms(problem, threshold, 150, memory=0.8)
    assert plain > 0.4
    assert corrected < 0.4 * plain


def test_the_smallest_detectable_size_is_found_four_times_in_five():
    problem = LinearProblem(signals=1)
    threshold = threshold_of(problem)
    rng = np.random.default_rng(3)
    first = replace(signals(problem.fit(rng), problem)[0], variance_inflation=1.0)
    size = smallest_detectable(first, 0, threshold)
    shift = -size * problem.columns[0][:, 0]
    power = alarms(problem, threshold, 400, corrected=False, added=shift)
    half = alarms(problem, threshold, 400, corrected=False, added=0.5 * shift)
    assert power == pytest.approx(0.8, abs=0.06)
    assert half < 0.5


@pytest.mark.parametrize("left", [0.3, 0.99])
def test_a_coefficient_that_far_off_is_found_four_times_in_five(left):
    """The posterior mean of what is off by z has mean z * left and variance left."""
    coefficient, rng = Coefficient("tail.lift.c1"), np.random.default_rng(0)

    def found(score):
        cause = Cause(coefficient)
        column = np.zeros((1, 1))
        return Signal(cause, -1, column, 1.0, np.array([[left]]), np.array([score]), 1.0)

    threshold = np.log(1e-3)
    sizes = coefficient_sizes([found(0.0)], lambda s: smallest_detectable(s, 0, threshold))
    size = sizes[coefficient]
    means = size * left + np.sqrt(left) * rng.standard_normal(2000)
    power = np.mean([found(mean).log_p < threshold for mean in means])
    assert power == pytest.approx(0.8, abs=0.03)
    assert size > 3.0  # what one of a thousand priors allows is no finding


def test_confusability_of_equal_and_of_unlike_signals():
    fit = PROBLEM.fit(np.random.default_rng(0))
    a, b, *_ = signals(fit)
    assert confusability(a, a) == pytest.approx(1.0)
    assert 0.3 < confusability(a, b) < 0.7  # half of each is shared
    rng = np.random.default_rng(8)
    white = Projector(fit).signal(a.cause, 0, rng.standard_normal((PROBLEM.size, 1)))
    assert confusability(a, white) < 0.15


@dataclass(frozen=True)
class Found:
    cause: Cause
    log_p: float


def test_the_best_alternative_speaks_for_a_cause_and_the_strongest_cause_comes_first():
    drag, lag = Cause("drag"), Cause("lag")
    found = [Found(drag, -3.0), Found(lag, -5.0), Found(drag, -9.0), Found(lag, -1.0)]
    assert best_of_each(found, lambda f: f.log_p) == [found[2], found[1]]


def test_a_cause_like_a_coefficient_is_found_where_that_has_gone_as_far_as_it_may():
    """Nine prior deviations of inertia are what an added mass in yaw alone looks like."""
    fish = load_fish(FISH)
    path = "inertia.rest[2]"
    far = fish.get(path) + 9.0 * fish.prior_sd(path)
    data = simulate(Setup(seed=4, runs=3, duration=10.0, changes={path: far}))
    problem = SeriesProblem(data, paths=PATHS)
    refitted = fit(problem, rounds=1)
    assert Coefficient(path) in refitted.at_bounds
    causes = [cause for cause in causes_of(problem) if cause.id == "added_mass"]
    found, hidden = (
        screen(baseline, causes, np.random.default_rng(0)).best()[0]
        for baseline in (refitted, replace(refitted, active=refitted.active[:0]))
    )
    assert found.statistic > 100.0
    assert hidden.statistic < 0.25 * found.statistic
