"""What the usual steps get wrong of a tail whose rate jumps does not stay in its estimate."""

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.identification import SeriesProblem, fit
from fish_env.inference.hypotheses import EffectParameterId
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
def test_what_steps_get_wrong_goes_with_their_length(fitted):
    """As extrapolating needs: what is left of it is what does not."""
    usual, finer = fitted.problem, fitted.problem.refined()[0]
    finest = finer.refined()[0]
    effects = {path: np.array([value]) for path, value in fitted.point.effects.items()}
    at = fitted.point.z[:, None], effects, fitted.noise, fitted.filtered
    exact = finest.innovations(*at)
    wrong = [np.linalg.norm(p.innovations(*at) - exact) for p in (usual, finer)]
    expected = (1.0 - 1.0 / 16.0) / (1.0 / 4.0 - 1.0 / 16.0)
    assert wrong[0] / wrong[1] == pytest.approx(expected, rel=0.25)


@pytest.mark.slow
@pytest.mark.long
def test_one_step_leads_to_where_fits_in_ever_finer_steps_end(fitted):
    held = {"refit_noise": False, "iterations": 2}
    finer = fitted.problem.refined()[0]
    fine, finest = (
        fit(problem, (LIMIT,), fitted.point, fitted.noise, **held).estimates
        for problem in (finer, finer.refined()[0])
    )
    end = (4.0 * finest - fine) / 3.0
    assert distances(fitted.extrapolated, end).max() < 0.3
    assert distances(fitted, end).max() > 2.0


@pytest.mark.slow
@pytest.mark.long
def test_it_leads_towards_the_truth(case, fitted):
    def off(found):
        at = found.ids.index(EffectParameterId(LIMIT, "rate"))
        return (found.estimates[at] - case[1]) / np.sqrt(found.covariance[at, at])

    assert abs(off(fitted)) > abs(off(fitted.extrapolated)) + 1.0


@pytest.mark.slow
@pytest.mark.long
def test_everything_else_stays(fitted):
    moved = fitted.extrapolated
    assert moved.linearised.slopes is fitted.linearised.slopes
    assert moved.extrapolated is moved
    np.testing.assert_array_equal(moved.covariance, fitted.covariance)
    index = len(moved.problem.baseline)
    assert moved.point.effects[EffectParameterId(LIMIT, "rate")] == moved.estimates[index]


def test_a_tail_without_jumps_needs_no_finer_steps(case):
    data = case[0]
    plain = fit(SeriesProblem(data, run_ids=data.ids[:1]), (), rounds=1, iterations=1)
    assert plain.extrapolated is plain
