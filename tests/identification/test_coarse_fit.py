"""Sketches keep the gains of a filter: they must rank models as filtering anew does."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.identification import SeriesProblem, fit
from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.estimate.free import Free, objective, objectives_with_gains
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from tests.diagnosis.small_cases import small_case

LAG = EffectParameterId("servo_lag", "time_constant")


@pytest.fixture(scope="module")
def baseline(tmp_path_factory):
    folder = tmp_path_factory.mktemp("late") / "data"
    small_case(folder, {"servo_lag": 1.0}, runs=2)
    return fit(SeriesProblem(load_dataset(folder)), rounds=2)


def vectors(free, baseline):
    """Some lags, and a heavier fish, around the baseline."""
    points = [Point(baseline.point.z, {LAG: lag}) for lag in (0.0, 0.02, 0.04, 0.06, 0.09)]
    heavier = baseline.point.z.copy()
    heavier[baseline.problem.baseline.paths.index("mass.total")] += 1.0
    return [free.pack(point) for point in (*points, Point(heavier, {LAG: 0.06}))]


def test_objectives_with_gains_differ_as_filtered_ones_do(baseline):
    """Under a disturbance that is plausible: gains under one that stands in for the lag differ."""
    problem, free = baseline.problem, Free(baseline.problem, ["servo_lag"], ())
    noise = replace(baseline.noise, force_sd=0.01, moment_sd=3e-4, correlation_s=1.0)
    filtered = problem.filtered(baseline.point, noise)
    tried = vectors(free, baseline)
    kept = objectives_with_gains(problem, free, tried, noise, filtered)
    anew = [objective(problem, free, vector, noise)[0] for vector in tried]
    assert np.ptp(anew) > 200.0
    np.testing.assert_allclose(np.diff(kept), np.diff(anew), atol=0.03 * np.ptp(anew))
    np.testing.assert_array_equal(np.argsort(kept), np.argsort(anew))


def test_impossible_and_diverging_models_do_not_lead(baseline):
    problem, free = baseline.problem, Free(baseline.problem, ["servo_lag"], ())
    vector = free.pack(Point(baseline.point.z, {LAG: 0.05}))
    impossible = vector.copy()
    impossible[problem.baseline.paths.index("mass.total")] = -1e4
    diverging = vector.copy()
    diverging[-1] = 1e-5  # a lag that no step follows
    found = objectives_with_gains(
        problem, free, [vector, impossible, diverging], baseline.noise, baseline.filtered
    )
    assert np.isinf(found[1])
    assert found[2] > 1e6 * found[0] > 0.0


def test_a_sketch_comes_near_what_a_fit_finds(baseline):
    fitter = CoarseFitter(baseline)
    begin = [Point(baseline.point.z, {LAG: lag}) for lag in (0.01, 0.2)]
    sketch = fitter.coarse_fit(["servo_lag"], (), begin)
    found = fit(baseline.problem, ["servo_lag"], sketch.point, baseline.noise, refit_noise=False)
    assert sketch.objective < fitter.base - 100.0
    i = found.ids.index(LAG)
    error = sketch.point.effects[LAG] - found.estimates[i]
    assert abs(error) < 2.0 * np.sqrt(found.covariance[i, i])


def test_the_objective_that_comes_with_the_slopes_is_that_of_the_same_gains(baseline):
    problem, free = baseline.problem, Free(baseline.problem, ["servo_lag"], ())
    fitter, tried = CoarseFitter(baseline), vectors(free, baseline)
    alone = objectives_with_gains(problem, free, tried, baseline.noise, baseline.filtered)
    slopes = Slopes(free, baseline.noise)
    with_slopes = [fitter._surveyed(problem, slopes, vector)[0] for vector in tried]
    np.testing.assert_allclose(with_slopes, alone, rtol=1e-9)
    impossible = tried[0].copy()
    impossible[problem.baseline.paths.index("mass.total")] = -1e4
    assert np.isinf(fitter._surveyed(problem, slopes, impossible)[0])


class Counting(SeriesProblem):
    """A problem that counts how often it is asked for residuals."""

    def __init__(self, *given):
        super().__init__(*given)
        self.asked = []

    def innovations(self, *given):
        self.asked.append(1)
        return super().innovations(*given)


def test_a_sketch_that_will_not_get_there_ends_early(baseline):
    problem = Counting(baseline.problem.dataset)
    fitter = CoarseFitter(replace(baseline, problem=problem))
    begin = [Point(baseline.point.z, {LAG: 0.01})]
    counts, objectives, least = [], [], fitter.base
    for give_up_above in (np.inf, least, -1e9):
        problem.asked.clear()
        objectives.append(fitter.coarse_fit(["servo_lag"], (), begin, give_up_above).objective)
        counts.append(len(problem.asked))
    assert counts[0] == counts[1] > counts[2] == 2  # where it begins, with and without slopes
    assert objectives[0] == objectives[1] < least < objectives[2]
