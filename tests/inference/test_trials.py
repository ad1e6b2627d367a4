"""Effects that an uneven drive hides are tried in fits of their own."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import screen
from fish_env.inference.trials import tried_out
from fish_env.inference.vehicle import Drive
from tests.inference.stated import Stated, effect, size_of

RUNS, SAMPLES = 4, 30
LATE, OTHER = "late", "other"


def problem(late=0.5, uneven=True, swamped=True):
    """Runs of a vehicle whose effect ``late`` acts by its square: none leads from zero."""
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((2, RUNS, SAMPLES))
    noise = rng.standard_normal((RUNS, SAMPLES))

    def residuals(z, effects):
        off = effects[size_of(LATE)] ** 2 - late**2
        return noise - 40.0 * off * x - effects[size_of(OTHER)] * y - z[0] * y

    stated = Stated(residuals, (effect(LATE, lower=0.0), effect(OTHER)))
    stated.hidden_by_drive, stated.drive = (LATE,), Drive(uneven=uneven)
    stated.swamped = lambda noise: swamped
    return stated


def found_in(stated, told=None):
    nothing = Explanation((), fit(stated))
    shown = screen(nothing.fit, causes_of(stated), np.random.default_rng(0))
    report = [] if told is None else told
    return tried_out(nothing, shown, report.append)


def test_an_effect_without_a_slope_is_found():
    told = []
    found = found_in(problem(), told)
    assert found.causes == (LATE,)
    assert found.fit.point.effects[size_of(LATE)] == pytest.approx(0.5, abs=0.05)
    assert any(LATE in step and OTHER not in step for step in told)


def test_nothing_is_found_where_nothing_is_late():
    assert found_in(problem(late=0.0)) is None


def alike(seed=1):
    """A lag, and another that in the runs of a trial acts nearly so, and fits a little better."""
    rng = np.random.default_rng(seed)
    x, y, more = rng.standard_normal((3, RUNS, SAMPLES))
    noise = rng.standard_normal((RUNS, SAMPLES))
    tried = np.isin(np.arange(RUNS), Stated(lambda z, e: x).spread(POLICY.few_runs))[:, None]
    other = np.where(tried, x + 0.1 * more, y)
    acts = np.where(tried, other, x)

    def residuals(z, effects):
        late, like = effects[size_of(LATE)] ** 2, effects[size_of(OTHER)] ** 2
        return noise + 40.0 * (0.25 * acts - late * x - like * other) - z[0] * y

    stated = Stated(residuals, (effect(LATE, lower=0.0), effect(OTHER, lower=0.0)))
    stated.hidden_by_drive, stated.drive = (LATE, OTHER), Drive(uneven=True)
    stated.swamped = lambda noise: True
    return stated


def test_lags_that_explain_alike_are_compared_on_all_runs():
    told = []
    assert found_in(alike(), told).causes == (LATE,)
    assert told[-1] == f"fitting {OTHER}, {LATE}, each alone"


def test_an_effect_that_ends_switched_off_is_no_cause():
    """Coefficients of a nominal vehicle may lead further; what that gains is not the effect's."""
    stated = problem(late=0.0)
    shown_in = np.isin(np.arange(RUNS), stated.spread(POLICY.few_runs))[:, None]
    x = np.random.default_rng(2).standard_normal((RUNS, SAMPLES))
    noise = np.random.default_rng(3).standard_normal((RUNS, SAMPLES))
    # The runs of a trial show it, the other one the contrary, which no size of it explains.
    asked = np.where(shown_in, 0.1, -1.0) * x
    stated.residuals = lambda z, effects: noise + 10.0 * (asked - effects[size_of(LATE)] ** 2 * x)
    begun = fit(stated)
    far = Explanation((), replace(begun, objective=begun.objective + 1e4))
    shown = screen(begun, causes_of(stated), np.random.default_rng(0))
    told = []
    assert tried_out(far, shown, told.append) is None
    assert told[-1] == f"fitting {LATE}, each alone"


def two_lags(far=0.0):
    """Two lags; a coefficient is far from where it is known to be."""
    rng = np.random.default_rng(4)
    x, y, w = rng.standard_normal((3, RUNS, SAMPLES))
    noise = rng.standard_normal((RUNS, SAMPLES))

    def residuals(z, effects):
        late, like = effects[size_of(LATE)] ** 2, effects[size_of(OTHER)] ** 2
        return noise + 40.0 * ((0.25 - late) * x + (0.16 - like) * y + (far - z[0]) * w)

    stated = Stated(residuals, (effect(LATE, lower=0.0), effect(OTHER, lower=0.0)))
    stated.hidden_by_drive, stated.drive = (LATE, OTHER), Drive(uneven=True)
    stated.swamped = lambda noise: False
    return stated


def second_beside(stated, first, told):
    point = replace(stated.start, effects={size_of(name): 0.5 for name in first})
    own = Explanation(first, fit(stated, first, point))
    shown = screen(own.fit, causes_of(stated), np.random.default_rng(0))
    return tried_out(own, shown, told.append)


def test_a_second_lag_is_tried_from_the_fit_with_the_first():
    """A vehicle whose coefficients are far off is where that fit has them, not as described."""
    told = []
    found = second_beside(two_lags(far=3.0), (LATE,), told)
    assert found.causes == (LATE, OTHER)
    assert found.fit.point.effects[size_of(LATE)] == pytest.approx(0.5, abs=0.05)
    assert found.fit.point.effects[size_of(OTHER)] == pytest.approx(0.4, abs=0.05)
    assert any(OTHER in step and LATE not in step for step in told)


def test_no_second_lag_is_tried_without_a_first():
    told = []
    assert second_beside(two_lags(), (), told) is None
    assert told == []


@pytest.mark.parametrize("settings", [{"uneven": False}, {"swamped": False}])
def test_nothing_is_tried_where_nothing_hides(settings):
    told = []
    assert found_in(problem(**settings), told) is None
    assert told == []
