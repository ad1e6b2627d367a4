"""Effects that an uneven drive hides are tried in fits of their own."""

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
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


@pytest.mark.parametrize("settings", [{"uneven": False}, {"swamped": False}])
def test_nothing_is_tried_where_nothing_hides(settings):
    told = []
    assert found_in(problem(**settings), told) is None
    assert told == []
