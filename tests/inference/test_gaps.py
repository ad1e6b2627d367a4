"""Lags between off and what simulation steps are stable at: steps go to either end of the gap."""

import numpy as np
import pytest

from fish_env.inference.effects import DeclaredEffect
from fish_env.inference.estimate.bounds import Gap, LinearBounds
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.free import Free
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.inference.vehicle import STABLE
from tests.inference.stated import SIZE, Stated, effect, size_of

STEP, LAG = 0.1, "lag"
STABLE_FROM = STABLE * STEP


class Lag(DeclaredEffect):
    """Followed where it is off or lasts a step."""

    def is_followed(self, values, step):
        return values[SIZE] == 0.0 or values[SIZE] >= step


def problem(true_lag):
    """Runs with a coefficient of 1.5 and a lag; shorter ones than are stable diverge."""
    rng = np.random.default_rng(5)
    x, y = rng.standard_normal((2, 3, 60))
    noise = 0.1 * rng.standard_normal((3, 60))

    def residuals(z, effects):
        lag = effects[size_of(LAG)]
        left = noise + 30.0 * (true_lag - lag) * x + (1.5 - z[0]) * (y + 0.3 * x)
        return np.full_like(left, np.nan) if 0.0 < lag < 0.99 * STABLE_FROM else left

    declared = effect(LAG, lower=0.0)
    return Stated(residuals, [Lag(LAG, declared.parameters)], step=STEP)


def fitted(true_lag, begin):
    stated = problem(true_lag)
    start = Point(np.zeros(1), {size_of(LAG): begin})
    found = fit(stated, [LAG], start=start, refit_noise=False)
    return found.point.effects[size_of(LAG)], found.point.z[0]


@pytest.mark.parametrize(("true_lag", "begin"), [(0.08, 0.2), (0.08, 0.06), (0.0, 0.0)])
def test_a_lag_that_steps_follow_is_found(true_lag, begin):
    lag, z = fitted(true_lag, begin)
    assert lag == pytest.approx(true_lag, abs=0.01)
    assert z == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize("begin", [0.2, 0.06])
def test_a_shorter_one_stays_where_it_is_stable_and_holds_nothing_else_back(begin):
    lag, z = fitted(0.03, begin)
    assert lag == pytest.approx(STABLE_FROM, rel=1e-6)
    beside = 1.5 + 30.0 * (0.03 - STABLE_FROM) * 0.3 / 1.09  # what the coefficient makes up for
    assert z == pytest.approx(beside, abs=0.1)


def test_one_that_is_off_stays_off_or_goes_beyond_the_gap():
    assert fitted(0.01, 0.0)[0] == 0.0
    assert fitted(0.03, 0.0)[0] == pytest.approx(STABLE_FROM, rel=1e-6)


def test_the_gap_ends_where_steps_are_stable():
    (gap,) = Free(problem(0.0), [LAG], ()).bounds.gaps
    assert gap.number == 1
    assert gap.off == 0.0
    assert gap.least == pytest.approx(STABLE_FROM, rel=1e-6)
    assert Free(problem(0.0), [LAG], ()).ids[1] == EffectParameterId(LAG, SIZE)


def test_bounds_move_what_is_in_a_gap_to_its_nearer_end():
    bounds = LinearBounds(np.eye(1), np.zeros(1), np.ones(1), (Gap(0, 0.0, 0.4),))
    moved = [bounds.clip(np.array([value]))[0] for value in (0.0, 0.1, 0.3, 0.4, 0.7)]
    assert moved == [0.0, 0.0, 0.4, 0.4, 0.7]
    assert bounds.beside(np.array([0.5])).low.tolist() == [0.4]
    assert bounds.beside(np.array([0.0])) is bounds
