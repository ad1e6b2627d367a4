"""Causes are compared in long steps where those tell the same, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification import SeriesProblem, fit
from fish_env.identification.generic_forces import BoundForces, generic_forces
from fish_env.inference.changes import residual_changes
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, Setup, simulate

QUICK_LAG = ("servo_lag", {"time_constant": 0.01})
SLOW_LAG = ("servo_lag", {"time_constant": 0.1})
SHORT = {"runs": 1, "duration": 4.0}


def among(own, kind):
    """The fit to a problem of another kind, with the same runs."""
    return replace(own, problem=kind(simulate(Setup(**SHORT)), paths=PATHS))


@pytest.fixture
def fitted():
    setup = Setup(**SHORT)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    return fit(problem, iterations=1, refit_noise=False, noise=setup.noise)


def changes(own, *jobs):
    return residual_changes(own, jobs, np.repeat(own.point.z[:, None], len(jobs), axis=1)).T


def test_a_usual_fit_looks_the_same_in_long_steps(fitted):
    assert fitted.comparing.longest_step == pytest.approx(2.0 * fitted.problem.longest_step)


@pytest.mark.parametrize("wrong", [0.02, np.nan])
def test_one_that_does_not_is_compared_in_its_own(fitted, wrong):
    lin = fitted.linearised
    other = replace(fitted, linearised=replace(lin, residuals=lin.residuals + wrong))
    assert other.comparing is other.problem


class Diverging:
    """A problem in whose steps the first setting diverges."""

    def __init__(self, problem):
        self.problem = problem

    def __getattr__(self, name):
        return getattr(self.problem, name)

    def changes(self, *given):
        out = self.problem.changes(*given)
        out[0, 100:] = np.nan
        return out


class UsualSteps(SeriesProblem):
    """A problem without long steps."""

    def with_long_steps(self):
        return self


class DivergingSteps(SeriesProblem):
    """A problem whose long steps do not follow the first setting."""

    def with_long_steps(self):
        return Diverging(super().with_long_steps())


def test_a_setting_that_long_steps_do_not_follow_takes_the_usual_ones(fitted):
    quick, slow = changes(among(fitted, DivergingSteps), QUICK_LAG, SLOW_LAG)
    usual = changes(among(fitted, UsualSteps), QUICK_LAG, SLOW_LAG)
    np.testing.assert_array_equal(quick, usual[0])
    assert np.linalg.norm(slow - usual[1]) < 0.01 * np.linalg.norm(usual[1])
    assert not np.array_equal(slow, usual[1])


@pytest.fixture(scope="module")
def limited():
    """A fit with a rate limit in it, and forces along it."""
    setup = Setup(**SHORT)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    limit = Point(
        np.zeros(len(problem.baseline)), {EffectParameterId("servo_rate_limit", "rate"): 2.5}
    )
    held = {"refit_noise": False, "noise": setup.noise}
    own = fit(problem, ("servo_rate_limit",), limit, iterations=1, **held)
    return own, generic_forces(problem.runs, own.filtered, problem.channels)


def test_a_push_does_the_same_in_long_steps_where_the_tails_rate_jumps(limited):
    own, forces = limited
    long = BoundForces(own, forces).changes(forces.columns)
    usual = BoundForces(among(own, UsualSteps), forces).changes(forces.columns)
    assert not np.array_equal(long, usual)
    off = np.linalg.norm(long - usual, axis=0) / np.linalg.norm(usual, axis=0)
    assert off.max() < 0.05
    assert np.median(off) < 0.01


def test_pushes_that_long_steps_do_not_follow_take_the_usual_ones(limited):
    own, forces = limited
    few = forces.columns[:6]
    found = BoundForces(among(own, DivergingSteps), forces).changes(few)
    usual = BoundForces(among(own, UsualSteps), forces).changes(few)
    np.testing.assert_array_equal(found, usual)
