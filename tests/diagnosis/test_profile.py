"""Intervals by likelihood: where a fit is normal they are the usual ones, and where not, honest."""

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.diagnosis.tables.pipeline import refitted, split_conditions
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import table_of
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.profile import Held, Profile, profiled
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.params import load_fish
from tests.diagnosis.test_steady import table
from tests.hidden.cases import make_case

PATH = EffectParameterId("tail_reactive", "scale")
WORSE = 3.841


def profile(objective, estimate, sd, bounds=(0.0, 3.0), worse=WORSE):
    """The profile of a fit of one number whose objective is known everywhere."""
    return Profile(
        lambda value, near: Held(value, objective(value), None, ()),
        Held(estimate, objective(estimate), None, ()), sd, bounds, worse,
    )  # fmt: skip


def interval(*given, **named):
    own = profile(*given, **named)
    return own.interval(own.seen())


def test_a_parabola_has_the_normal_interval():
    low, high = interval(lambda x: 7.0 + ((x - 1.0) / 0.2) ** 2, 1.0, 0.2)
    assert low == pytest.approx(1.0 - 1.96 * 0.2, abs=0.02)
    assert high == pytest.approx(1.0 + 1.96 * 0.2, abs=0.02)


def test_coloured_residuals_widen_it():
    low, high = interval(lambda x: 7.0 + ((x - 1.0) / 0.2) ** 2, 1.0, 0.4, worse=4.0 * WORSE)
    assert low == pytest.approx(1.0 - 1.96 * 0.4, abs=0.04)
    assert high == pytest.approx(1.0 + 1.96 * 0.4, abs=0.04)


def test_two_minima_alike_are_both_in_the_interval():
    """Near either of them the curvature knows nothing of the other."""

    def objective(x):
        return min(((x - 0.3) / 0.1) ** 2, 0.05 + ((x - 0.7) / 0.1) ** 2)

    low, high = interval(objective, 0.3, 0.1)
    assert low == pytest.approx(0.3 - 0.196, abs=0.02)
    assert high == pytest.approx(0.7 + 0.196, abs=0.02)


def test_what_nothing_ends_reaches_its_bound():
    assert interval(lambda x: 0.0, 1.0, 0.1) == (0.0, 3.0)
    low, high = interval(lambda x: np.inf if x > 1.5 else 0.0, 1.0, 1.0)
    assert low == 0.0
    assert high == pytest.approx(1.5, abs=0.05)  # the simulation diverges beyond


def test_a_better_minimum_on_the_way_is_seen():
    def objective(x):
        return min(((x - 0.3) / 0.1) ** 2, ((x - 0.6) / 0.1) ** 2 - 5.0)

    seen = profile(objective, 0.3, 0.1).seen()
    assert min(held.objective for held in seen) < -4.0


@pytest.fixture(scope="module")
def reactive() -> tuple[Fit, float]:
    """A table of a fish whose tail throws water, and the fit that begins without it, at a bound."""
    scale = 0.7
    data = table({"tail_reactive": {"scale": scale}})
    problem = TableProblem(table_of(data), load_fish("zheng-2021-a"))
    return fit(problem, ["tail_reactive"]), scale


def test_a_fit_leaves_the_bound_at_which_an_effect_is_absent(reactive):
    own, scale = reactive
    truth = Point(own.problem.start.z, {PATH: scale})
    from_truth = fit(own.problem, own.effects, truth, own.noise, refit_noise=False, iterations=12)
    assert own.objective < from_truth.objective + 0.5


@pytest.mark.slow
@pytest.mark.long
def test_the_interval_holds_the_truth_and_a_better_minimum_is_taken(reactive):
    own, scale = reactive
    known = profiled(own)
    low, high = known.interval(PATH)
    assert low < scale < high
    far = Point(own.point.z, {PATH: 1.4})
    begun = fit(own.problem, own.effects, far, own.noise, refit_noise=False, iterations=1)
    assert begun.objective > own.objective + 1.0
    assert profiled(begun).objective < begun.objective - 0.9


@pytest.mark.slow
@pytest.mark.long
def test_a_refit_is_not_stuck_where_its_first_noise_led(tmp_path):
    """Under the first guess of the noise another minimum is nearer."""
    make_case("steady", 5002, tmp_path / "case")
    data = load_dataset(tmp_path / "case")
    whole = TableProblem(table_of(data), load_fish(data.fish))
    problem = whole.on(split_conditions(data, whole.table, 5002)[0])
    own = refitted(problem)
    from_nominal = fit(problem, noise=own.noise, refit_noise=False, iterations=12)
    assert own.objective < from_nominal.objective + 0.5
