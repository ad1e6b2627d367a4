"""Intervals by likelihood: where a fit is normal they are the usual ones, and where not, honest."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.diagnosis.steady import profile
from fish_env.diagnosis.steady.fitting import SteadyFit, fit, fit_near
from fish_env.diagnosis.steady.pipeline import split_conditions
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.profile import profiled
from fish_env.diagnosis.steady.table import table_of
from fish_env.identification.problem import Point
from fish_env.params import load_fish
from tests.diagnosis.test_steady import table
from tests.hidden.cases import make_case

PATH = "effects.tail_reactive.scale"


def fit_with(objective, estimate, sd, bounds=(0.0, 3.0)):
    """A fit of one number whose objective is known everywhere."""
    return SimpleNamespace(
        problem=None, effects=("tail_reactive",), names=(PATH,), estimates=np.array([estimate]),
        covariance=np.array([[sd**2]]), bounds=lambda path: bounds, point=None, orbits=None,
        objective=objective(estimate),
    )  # fmt: skip


@pytest.fixture
def known(monkeypatch):
    """Puts a known objective in the place of fits with the number held."""

    def use(objective):
        monkeypatch.setattr(
            profile, "objective_at", lambda fit, path, value, near: (objective(value), *near)
        )
        monkeypatch.setattr(
            profile, "freedoms_of", lambda problem, effects: [SimpleNamespace(path=PATH)]
        )
        monkeypatch.setattr(profile, "replace", lambda fit, profiles: profiles[PATH])
        return objective

    return use


def test_a_parabola_has_the_normal_interval(known):
    low, high = profiled(fit_with(known(lambda x: 7.0 + ((x - 1.0) / 0.2) ** 2), 1.0, 0.2))
    assert low == pytest.approx(1.0 - 1.96 * 0.2, abs=0.02)
    assert high == pytest.approx(1.0 + 1.96 * 0.2, abs=0.02)


def test_two_minima_alike_are_both_in_the_interval(known):
    """Near either of them the curvature knows nothing of the other."""

    def objective(x):
        return min(((x - 0.3) / 0.1) ** 2, 0.05 + ((x - 0.7) / 0.1) ** 2)

    low, high = profiled(fit_with(known(objective), 0.3, 0.1))
    assert low == pytest.approx(0.3 - 0.196, abs=0.02)
    assert high == pytest.approx(0.7 + 0.196, abs=0.02)


def test_what_nothing_ends_reaches_its_bound(known):
    assert profiled(fit_with(known(lambda x: 0.0), 1.0, 0.1)) == (0.0, 3.0)
    low, high = profiled(fit_with(known(lambda x: np.inf if x > 1.5 else 0.0), 1.0, 1.0))
    assert low == 0.0
    assert high == pytest.approx(1.5, abs=0.05)  # no steady motion beyond


def test_a_better_minimum_on_the_way_is_taken(known, monkeypatch):
    def objective(x):
        return min(((x - 0.3) / 0.1) ** 2, ((x - 0.6) / 0.1) ** 2 - 5.0)

    moved = fit_with(known(objective), 0.6, 0.1)
    monkeypatch.setattr(profile, "fit_near", lambda fit, point, orbits: moved)
    low, high = profiled(fit_with(objective, 0.3, 0.1))
    assert (low, high) == (pytest.approx(0.404, abs=0.02), pytest.approx(0.796, abs=0.02))


@pytest.fixture(scope="module")
def reactive() -> tuple[SteadyFit, float]:
    """A table of a fish whose tail throws water, and the fit that begins without it, at a bound."""
    scale = 0.7
    data = table({"tail_reactive": {"scale": scale}})
    problem = SteadyProblem(table_of(data), load_fish("zheng-2021-a"))
    return fit(problem, ["tail_reactive"]), scale


def test_a_fit_leaves_the_bound_at_which_an_effect_is_absent(reactive):
    own, scale = reactive
    problem = own.problem
    truth = Point(problem.start.z, {PATH: scale})
    from_truth = fit_near(own, truth, problem.orbits([truth]))
    assert own.objective < from_truth.objective + 0.5


def test_the_interval_holds_the_truth(reactive):
    own, scale = reactive
    low, high = profiled(own).interval(PATH)
    assert low < scale < high


def test_a_refit_is_not_stuck_where_its_first_noise_led(tmp_path):
    """Under the first guess of the noise another minimum is nearer."""
    make_case("steady", 5002, tmp_path / "case")
    data = load_dataset(tmp_path / "case")
    whole = SteadyProblem(table_of(data), load_fish(data.fish))
    problem = whole.on(split_conditions(data, whole.table, 5002)[0])
    own = fit(problem)
    polished = fit_near(own, own.point, own.orbits)
    from_nominal = fit_near(own, problem.start, problem.orbits([problem.start]))
    assert polished.objective < from_nominal.objective + 0.5
