"""Slopes kept along a descent: which are worked out, which are taken over, what a fit ends with."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.free import Free, linearise
from fish_env.inference.estimate.gauss_newton import predicted_decrease
from fish_env.inference.estimate.slopes import Slopes
from tests.inference.boat import NORTH, sail, split
from tests.inference.boat_problem import BoatProblem

TOLERANCE = 0.3


class Counted(BoatProblem):
    """A boat that notes how many points it is asked for at once."""

    def __init__(self, runs):
        super().__init__(runs)
        self.asked = []

    def innovations(self, z, effects, noise, filtered, pushes=None):
        self.asked.append(z.shape[1])
        return super().innovations(z, effects, noise, filtered, pushes)


@pytest.fixture(scope="module")
def sailed():
    runs = sail(np.random.default_rng(4), 6, {NORTH: 0.05})
    return Counted(split(runs, 6)[0])


@pytest.fixture
def begun(sailed):
    """The problem, its slopes, a vector, and the evaluation there."""
    problem = copy(sailed)
    problem.asked = []
    noise = problem.default_noise()
    free = Free(problem, ["current"], ())
    vector = free.pack(replace(problem.start, effects=problem.neutral(["current"])))
    return problem, Slopes(free, noise), vector, problem.filtered(free.unpack(vector), noise)


def test_exact_slopes_are_worked_out_once_for_an_evaluation(begun):
    problem, slopes, vector, filtered = begun
    plain = linearise(problem, slopes.free, vector, slopes.noise, filtered)
    for _ in range(2):
        np.testing.assert_array_equal(slopes.exact(problem, vector, filtered).slopes, plain.slopes)
    assert problem.asked == [1 + len(vector)] * 2  # the plain ones, and once those that are kept


def test_quick_slopes_are_new_by_effects_and_kept_by_coefficients(begun):
    problem, slopes, vector, filtered = begun
    free, noise = slopes.free, slopes.noise
    first = slopes.quick(problem, vector, filtered).slopes  # exact, as none were known
    moved = vector + 0.5
    there = problem.filtered(free.unpack(moved), noise)
    problem.asked.clear()
    quick = slopes.quick(problem, moved, there)
    assert problem.asked == [1 + len(vector) - free.count]
    expected = linearise(problem, free, moved, noise, there)
    np.testing.assert_array_equal(quick.residuals, expected.residuals)
    np.testing.assert_array_equal(quick.slopes[:, free.count :], expected.slopes[:, free.count :])
    np.testing.assert_array_equal(quick.slopes[:, : free.count], first[:, : free.count])
    assert np.any(quick.slopes[:, : free.count] != expected.slopes[:, : free.count])


def test_a_fit_ends_where_its_own_slopes_say_so(begun):
    """Kept slopes may lead the way, but they are not what a fit is judged by."""
    problem = begun[0]
    found = fit(problem, ["current"], refit_noise=False, iterations=30, tolerance=TOLERANCE)
    free = Free(problem, ["current"], ())
    vector, lin = free.pack(found.point), found.linearised
    plain = linearise(problem, free, vector, found.noise, found.filtered)
    count = free.count  # effects have their slopes over steps that suit the fit
    np.testing.assert_allclose(lin.slopes[:, :count], plain.slopes[:, :count], rtol=1e-9)
    np.testing.assert_allclose(lin.slopes[:, count:], plain.slopes[:, count:], atol=0.01)
    hessian = lin.slopes.T @ lin.slopes + np.diag(free.prior)
    gradient = lin.slopes.T @ lin.residuals + free.prior * vector
    step = free.bounds.step(hessian, gradient, vector)
    assert predicted_decrease(hessian, gradient, step) < TOLERANCE**2
