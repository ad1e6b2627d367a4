"""The quadratic minimum within a box, against the library's solver."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from fish_env.inference.estimate.box_qp import BoxModel, minimise_in_box

SETS = [(n, spread, seed) for seed, (n, spread) in enumerate(
    (n, spread) for n in (1, 4, 12, 40) for spread in (0.5, 3.0, 7.0, 12.0))]  # fmt: skip
EACH = 75


def problem(rng, n, spread):
    """A box problem of unknowns of different sizes, eigenvalues over ``spread`` decades.

    Some bounds are absent, some at zero, where the absent effects of a fit begin, and some equal.
    """
    vectors = np.linalg.qr(rng.standard_normal((n, n)))[0]
    root = 10.0 ** rng.uniform(-0.5 * spread, 0.0, (n, 1)) * vectors.T
    root = root * 10.0 ** rng.uniform(-2.0, 2.0, n)
    target = 4.0 * rng.standard_normal(n)
    sd = 1.0 / np.sqrt((root**2).sum(axis=0))
    tight = 10.0 ** rng.uniform(-1.0, 1.0)
    lower, upper = -rng.uniform(0.0, tight, n) * sd, rng.uniform(0.0, tight, n) * sd
    upper[rng.random(n) < 0.15] = np.inf
    lower[rng.random(n) < 0.15] = -np.inf
    lower[rng.random(n) < 0.15] = 0.0
    fixed = rng.random(n) < 0.05
    upper[fixed] = lower[fixed] = np.where(np.isfinite(lower[fixed]), lower[fixed], 0.0)
    return root, target, lower, upper


def model_of(root, target):
    return root.T @ root, -root.T @ target


def library(root, target, lower, upper):
    """The minimum by the library, which asks for bounds that differ."""
    open_ = upper > lower
    x = np.where(open_, 0.0, lower)
    if open_.any():
        limits = lower[open_], upper[open_]
        rest = target - root @ x
        x[open_] = lsq_linear(root[:, open_], rest, limits, method="bvls", tol=1e-15).x
    return x


def value(curvature, gradient, x):
    return gradient @ x + 0.5 * x @ curvature @ x


def excess(root, target, lower, upper, step):
    """How much a step misses the best known value by, as a share of what there is to gain."""
    model = model_of(root, target)
    best = value(*model, library(root, target, lower, upper))
    return (value(*model, step) - best) / max(abs(best), 1e-9)


def holds_what_it_hits(curvature, gradient, lower, upper):
    """A solver that never releases: what leaves the box is held at its bound for good."""
    free, x = np.ones(len(gradient), bool), np.zeros(len(gradient))
    for _ in range(len(gradient)):
        rest = -gradient[free] - curvature[np.ix_(free, ~free)] @ x[~free]
        x[free] = np.linalg.solve(curvature[np.ix_(free, free)], rest)
        out = free & ((x < lower) | (x > upper))
        if not out.any():
            break
        x[out] = np.clip(x[out], lower[out], upper[out])
        free &= ~out
    return x


@pytest.mark.parametrize(("n", "spread", "seed"), SETS)
def test_it_is_as_low_as_the_librarys(n, spread, seed):
    def unneeded(model):
        pytest.fail("not by itself")

    rng = np.random.default_rng(seed)
    for _ in range(EACH):
        root, target, lower, upper = problem(rng, n, spread)
        model = model_of(root, target)
        step, active = minimise_in_box(*model, lower, upper, fallback=unneeded)
        assert np.all((step >= lower) & (step <= upper))
        np.testing.assert_array_equal(step[active > 0], upper[active > 0])
        np.testing.assert_array_equal(step[active < 0], lower[active < 0])
        assert excess(root, target, lower, upper, step) < 1e-7


def test_the_comparison_notices_a_solver_that_releases_nothing():
    rng, worse = np.random.default_rng(1), 0
    for _ in range(100):
        root, target, lower, upper = problem(rng, 12, 3.0)
        step = holds_what_it_hits(*model_of(root, target), lower, upper)
        worse += excess(root, target, lower, upper, step) > 1e-7
    assert worse > 50


def test_the_active_bounds_are_those_that_hold():
    """With such a bound moved out the minimum is lower, with any other it stays."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        root, target, lower, upper = problem(rng, 8, 2.0)
        model = model_of(root, target)
        step, active = minimise_in_box(*model, lower, upper)
        for i in np.flatnonzero(upper > lower):
            out = 0.01 / np.sqrt(model[0][i, i])
            wide = lower - out * (np.arange(8) == i), upper + out * (np.arange(8) == i)
            gained = value(*model, step) - value(*model, minimise_in_box(*model, *wide).step)
            assert gained > -1e-9
            assert (gained > 1e-12) == (active[i] != 0)


def test_a_held_bound_is_released():
    """The first unknown leaves the box at first, and is inside once the second is held."""
    curvature, gradient = np.array([[1.0, 0.9], [0.9, 1.0]]), np.array([-1.5, 0.5])
    lower, upper = np.array([-9.0, -0.5]), np.array([2.0, 9.0])
    step, active = minimise_in_box(curvature, gradient, lower, upper)
    np.testing.assert_allclose(step, [1.95, -0.5])
    assert active.tolist() == [0, -1]
    np.testing.assert_allclose(
        holds_what_it_hits(curvature, gradient, lower, upper), [2.0, -0.5], atol=1e-12
    )


def test_without_bounds_it_is_newtons_step():
    none = np.full(2, np.inf)
    step, active = minimise_in_box(np.diag([1.0, 4.0]), np.array([1.0, 2.0]), -none, none)
    np.testing.assert_allclose(step, [-1.0, -0.5])
    assert not active.any()


def test_nothing_to_choose_is_no_error():
    step, active = minimise_in_box(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0))
    assert (len(step), len(active)) == (0, 0)


def test_zero_need_not_be_allowed():
    one = np.ones(1)
    step, active = minimise_in_box(np.eye(1), 0.0 * one, 2.0 * one, 3.0 * one)
    assert (step, active) == (2.0, -1)
    step, active = minimise_in_box(np.eye(1), 0.0 * one, -3.0 * one, -2.0 * one)
    assert (step, active) == (-2.0, 1)


def test_two_alike_to_rounding_stay_within_the_box():
    """What no data tells apart runs to a bound at most, and the sum is right."""
    curvature = np.ones((2, 2)) + np.diag([0.0, 1e-17])
    step, _ = minimise_in_box(curvature, np.array([-1.0, -1.0]), np.full(2, -3.0), np.full(2, 3.0))
    assert step.sum() == pytest.approx(1.0)
    assert np.all(np.abs(step) <= 3.0)


@pytest.mark.parametrize("spread", [0.5, 7.0])
def test_the_library_takes_over_where_changes_do_not_end(spread):
    def endless(model):
        return None

    rng = np.random.default_rng(3)
    for _ in range(EACH):
        root, target, lower, upper = problem(rng, 12, spread)
        step, active = minimise_in_box(*model_of(root, target), lower, upper, endless)
        assert np.all((step >= lower) & (step <= upper))
        np.testing.assert_array_equal(step[active > 0], upper[active > 0])
        assert excess(root, target, lower, upper, step) < 1e-6


def test_a_wrong_answer_of_the_active_set_is_noticed():
    def wrong(model):
        x, active = BoxModel.by_active_set(model)
        x[active == 0] *= 0.99
        return x, active

    root, target, lower, upper = problem(np.random.default_rng(4), 12, 2.0)
    step, active = minimise_in_box(*model_of(root, target), lower, upper, wrong)
    assert (active == 0).any()
    assert excess(root, target, lower, upper, step) < 1e-7


@pytest.mark.parametrize(
    ("curvature", "gradient"),
    [(np.nan, 1.0), (np.inf, 1.0), (0.0, 1.0), (-1.0, 1.0), (1.0, np.nan), (1.0, np.inf)],
)
def test_what_is_no_model_is_an_error(curvature, gradient):
    box = np.array([-1.0]), np.array([1.0])
    with pytest.raises(np.linalg.LinAlgError, match="positive definite"):
        minimise_in_box(np.array([[curvature]]), np.array([gradient]), *box)


def test_crossed_bounds_are_an_error():
    low, high = np.array([0.0, 2.0]), np.array([1.0, 1.0])
    with pytest.raises(ValueError, match=r"unknown 1: lower bound 2\.0 is above upper bound 1\.0"):
        minimise_in_box(np.eye(2), np.zeros(2), low, high)
