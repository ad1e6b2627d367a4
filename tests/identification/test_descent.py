"""The descent that fits of runs and of tables share, on problems whose answer is known."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from fish_env.inference.estimate.bounds import LinearBounds
from fish_env.inference.estimate.gauss_newton import SLIGHT, descend


def box(low, high):
    low, high = np.asarray(low, float), np.asarray(high, float)
    return LinearBounds(np.eye(len(low)), low, high)


class Counted:
    """A sum of squares that counts how often it is asked for."""

    def __init__(self, residuals, slopes):
        self.residuals, self.slopes, self.count = residuals, slopes, 0

    def evaluate(self, x):
        self.count += 1
        r = self.residuals(x)
        return float(r @ r), r

    def linearise(self, x, r):
        jacobian = self.slopes(x)
        return jacobian.T @ jacobian + 1e-9 * np.eye(len(x)), jacobian.T @ r


VALLEY = (
    lambda x: np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]),
    lambda x: np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]),
)
"""Rosenbrock's function."""


@pytest.mark.parametrize("high", [3.0, 0.7])
def test_it_finds_the_minimum_within_bounds(high):
    problem = Counted(*VALLEY)
    bounds = box([-2.0, -2.0], [high, 3.0])
    found, value, _ = descend(
        np.array([-1.2, 1.0]), problem.evaluate, problem.linearise, bounds, 60, 1e-4
    )
    best = least_squares(VALLEY[0], [-1.2, 0.4], bounds=([-2.0, -2.0], [high, 3.0]), xtol=1e-12)
    assert value <= 2.0 * best.cost + 1e-6
    np.testing.assert_allclose(found, best.x, atol=1e-3)


def test_it_leaves_a_bound_in_one_step():
    """Most effects begin absent, at a bound, from which methods that reflect creep away."""
    target = np.array([2.0, 3.0])
    problem = Counted(lambda x: x - target, lambda x: np.eye(2))
    found, _, _ = descend(
        np.zeros(2), problem.evaluate, problem.linearise, box([0.0, 0.0], [9.0, 9.0]), 1, 0.1
    )
    np.testing.assert_allclose(found, target, atol=1e-6)


@pytest.mark.parametrize("likeness", [0.0, 0.999999])
def test_two_that_act_alike_do_not_keep_it_going(likeness):
    """Each may go far for nothing; only what a combination gains counts."""
    root = np.array([[1.0, likeness], [0.0, np.sqrt(1.0 - likeness**2)]]) * 100.0
    start = np.linalg.solve(root, np.array([0.05, 0.05]))
    problem = Counted(lambda x: root @ x, lambda x: root)
    descend(start, problem.evaluate, problem.linearise, box([-9, -9], [9, 9]), 9, 0.1)
    assert problem.count == 1


@pytest.mark.parametrize(("promise", "counted"), [(0.7, 6), (7.0, 101)])
def test_it_does_not_follow_roughness(promise, counted):
    """Slopes across corners are a little wrong: only the shortest step gains, and hardly."""
    values = iter(np.repeat(np.arange(0.0, -3.0, -0.2 * SLIGHT), 5))
    asked = []

    def evaluate(x):
        asked.append(x)
        return next(values), None

    def linearise(x, known):
        return np.eye(1), np.array([np.sqrt(promise)])

    descend(np.zeros(1), evaluate, linearise, box([-99], [99]), 20, 0.01)
    assert len(asked) == counted


@pytest.mark.parametrize(
    ("give_up_above", "iterations", "counted"), [(101.0, 1, 2), (99.0, 1, 1), (99.0, 2, 2)]
)
def test_it_stops_where_the_steps_left_do_not_promise_enough(give_up_above, iterations, counted):
    """A step promises 25 of 125: enough for less than 101, or for less than 99 if two are left."""
    problem = Counted(lambda x: np.array([10.0, x[0] - 5.0]), lambda x: np.array([[0.0], [1.0]]))
    bounds = box([-9.0], [9.0])
    start = np.zeros(1)
    descend(start, problem.evaluate, problem.linearise, bounds, iterations, 0.1, give_up_above)
    assert problem.count == counted


@pytest.mark.parametrize(("gain", "counted"), [(1.0, 2), (24.0, 5)])
def test_what_promised_more_than_it_kept_is_given_up(gain, counted):
    """A step promises 25 each time. Four more lead below 60 only if they keep that."""
    values = iter(125.0 - gain * np.arange(9.0))

    def linearise(x, known):
        return np.eye(1), np.array([-5.0])

    def evaluate(x):
        asked.append(x)
        return next(values), None

    asked = []
    descend(np.zeros(1), evaluate, linearise, box([-99.0], [99.0]), 4, 0.1, 60.0)
    assert len(asked) == counted


def test_two_points_of_a_line_tell_where_slopes_miss_part_of_the_minimum():
    """No damped step is tried there: what slopes promise leads nowhere."""
    problem = Counted(lambda x: x, lambda x: np.eye(1))

    def linearise(x, known):
        return np.eye(1), np.array([-3.0])

    found, _, _ = descend(np.zeros(1), problem.evaluate, linearise, box([-9.0], [9.0]), 5, 0.1)
    assert found[0] == 0.0
    assert problem.count == 3


def test_a_start_without_an_objective_is_an_error():
    bounds = box([-1.0], [1.0])
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        descend(np.zeros(1), lambda x: (np.inf, None), lambda x, known: None, bounds, 3, 0.1)


def asked_for(rough_slopes):
    """How often a descent down the valley asks for exact slopes; where it ends."""
    problem, count = Counted(*VALLEY), []

    def exact(x, r):
        count.append(x)
        return problem.linearise(x, r)

    limits = (box([-2.0, -2.0], [3.0, 3.0]), 60, 1e-4)
    start = np.array([-1.2, 1.0])
    found, _, _ = descend(start, problem.evaluate, exact, *limits, quickly=rough_slopes)
    return len(count), found


def test_rough_slopes_end_no_descent():
    """It ends where exact slopes say so, and asks for fewer of them where the others are of use."""

    def rough(x, r):
        jacobian = VALLEY[1](x) + 0.3 * np.eye(2)
        return jacobian.T @ jacobian, jacobian.T @ r

    count, found = asked_for(rough)
    np.testing.assert_allclose(found, [1.0, 1.0], atol=1e-3)
    assert count < asked_for(None)[0]


def test_slopes_of_no_use_change_no_step():
    """Those that lead uphill are followed nowhere, so the descent is that of exact ones alone."""

    def uphill(x, r):
        jacobian = VALLEY[1](x)
        return jacobian.T @ jacobian, -jacobian.T @ r

    count, found = asked_for(uphill)
    alone, expected = asked_for(None)
    assert count == alone
    np.testing.assert_array_equal(found, expected)
