"""Causes are compared in long steps where those tell the same, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification import SeriesProblem, fit
from fish_env.identification.generic_forces import BoundForces, generic_forces
from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.problem import Point
from fish_env.inference.screening import residual_changes
from tests.identification.synthetic import PATHS, Setup, simulate

QUICK_LAG = ("servo_lag", {"time_constant": 0.01})
SLOW_LAG = ("servo_lag", {"time_constant": 0.1})


@pytest.fixture
def fitted():
    setup = Setup(runs=1, duration=4.0)
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


def test_a_setting_that_long_steps_do_not_follow_takes_the_usual_ones(fitted):
    own = replace(fitted)
    object.__setattr__(own, "comparing", Diverging(fitted.comparing))
    quick, slow = changes(own, QUICK_LAG, SLOW_LAG)
    object.__setattr__(own, "comparing", own.problem)
    usual = changes(own, QUICK_LAG, SLOW_LAG)
    np.testing.assert_array_equal(quick, usual[0])
    assert np.linalg.norm(slow - usual[1]) < 0.01 * np.linalg.norm(usual[1])
    assert not np.array_equal(slow, usual[1])


def test_only_what_jumps_is_sketched_in_the_usual_steps(fitted, monkeypatch):
    seen = []
    settled = CoarseFitter._surveyed

    def surveyed(self, problem, free, vector):
        seen.append(problem.longest_step)
        return settled(self, problem, free, vector)

    monkeypatch.setattr(CoarseFitter, "_surveyed", surveyed)
    for effect, value in (("servo_lag.time_constant", 0.05), ("servo_backlash.gap", 0.05)):
        start = Point(fitted.point.z, {f"effects.{effect}": value})
        CoarseFitter(fitted).coarse_fit((effect.split(".")[0],), (), [start])
    usual = fitted.problem.longest_step
    assert sorted(set(seen)) == pytest.approx([usual, 2.0 * usual])
    assert seen[0] == pytest.approx(2.0 * usual)


@pytest.fixture(scope="module")
def limited():
    """A fit with a rate limit in it, and forces along it."""
    setup = Setup(runs=1, duration=4.0)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    limit = Point(np.zeros(len(problem.baseline)), {"effects.servo_rate_limit.rate": 2.5})
    held = {"refit_noise": False, "noise": setup.noise}
    own = fit(problem, ("servo_rate_limit",), limit, iterations=1, **held)
    return own, generic_forces(problem.runs, own.filtered)


def test_a_push_does_the_same_in_long_steps_where_the_tails_rate_jumps(limited, monkeypatch):
    own, forces = limited
    long = BoundForces(own, forces).changes(forces.columns)
    monkeypatch.setattr(SeriesProblem, "with_long_steps", lambda self: self)
    usual = BoundForces(own, forces).changes(forces.columns)
    assert not np.array_equal(long, usual)
    apart = np.linalg.norm(long - usual, axis=0) / np.linalg.norm(usual, axis=0)
    assert apart.max() < 0.05
    assert np.median(apart) < 0.01


def test_pushes_that_long_steps_do_not_follow_take_the_usual_ones(limited, monkeypatch):
    own, forces = limited
    monkeypatch.setattr(SeriesProblem, "with_long_steps", lambda self: Diverging(self))
    assert np.isfinite(BoundForces(own, forces).changes(forces.columns[:6])).all()
