"""Estimates of a tail whose rate jumps are those that finer steps give."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.identification import SeriesProblem, fit
from tests.hidden.cases import make_case

LIMIT = "servo_rate_limit"


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finer") / "case"
    truth = make_case("rich", 3, folder, effects={LIMIT: 1.0})
    return load_dataset(folder), truth.effects[LIMIT]["rate"]


@pytest.fixture(scope="module")
def fitted(case):
    data = case[0]
    return fit(SeriesProblem(data, run_ids=data.ids[:4]), (LIMIT,), rounds=2)


def distances(own, estimates):
    """How far a fit is from estimates, in standard deviations of each parameter."""
    return np.abs(own.estimates - estimates) / np.sqrt(np.diag(own.covariance))


@pytest.mark.slow
@pytest.mark.long
def test_finer_steps_move_no_estimate(fitted):
    """Equal steps over the corners were off by more than two standard deviations."""
    problem = fitted.problem
    runs = [replace(run, substeps=8 * run.substeps) for run in problem.runs]
    usual, finer = (
        fit(p, (LIMIT,), fitted.point, fitted.noise, refit_noise=False, tolerance=0.01)
        for p in (problem, problem.with_runs(runs))
    )
    assert distances(usual, finer.estimates).max() < 0.2
