"""Runs evaluated at other parameters are remembered with their problem, and no longer."""

from __future__ import annotations

import gc
import weakref

import numpy as np

from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.problem import Point
from tests.inference.boat import sail
from tests.inference.boat_problem import BoatProblem


def test_the_same_question_is_answered_once():
    problem = BoatProblem(sail(np.random.default_rng(1), 2, {}))
    point, noise = problem.start, problem.default_noise()
    _, first = evaluated(problem, point, noise)
    assert evaluated(problem, point, noise)[1] is first
    other = Point(point.z + 0.1, dict(point.effects))
    _, second = evaluated(problem, other, noise)
    assert not np.array_equal(second[0].residuals, first[0].residuals)
    _, fresh = evaluated(problem.some([0]), point, noise)
    assert len(fresh) == 1


def test_what_was_evaluated_keeps_no_problem_alive():
    problem = BoatProblem(sail(np.random.default_rng(1), 2, {}))
    evaluated(problem, problem.start, problem.default_noise())
    gone = weakref.ref(problem)
    del problem
    gc.collect()
    assert gone() is None
