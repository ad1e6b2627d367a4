"""A search begun again beside the nominal vehicle, where the first one's fits were lost."""

import numpy as np
import pytest

from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.afresh import beside_nominal, searched_afresh
from fish_env.inference.attribution import Attribution
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import causes_of
from fish_env.inference.problem import Point
from fish_env.inference.screening import screen
from tests.inference.stated import Stated, effect, size_of

RUNS, SAMPLES = 4, 60
LARGE, SMALL, MUTE, IDLE = "large", "small", "mute", "idle"
LIMIT = 4.0
"""Largest plausible noise, in units of what the sensors have."""


def vehicle(large=0.8, small=0.4, further=0.0, known=(LARGE, SMALL, MUTE, IDLE), diverging=None):
    """A vehicle with two causes that act by their squares, one with four times the other's force.

    The effect ``mute`` does some of what the smaller does, and adds a misfit of its own.
    """
    rng = np.random.default_rng(5)
    x, y, u, v, w = rng.standard_normal((5, RUNS, SAMPLES))
    noise = rng.standard_normal((RUNS, SAMPLES))

    def residuals(z, effects):
        one = effects.get(size_of(LARGE), 0.0) ** 2 - large**2
        other = effects.get(size_of(SMALL), 0.0) ** 2 - small**2
        mute = effects.get(size_of(MUTE), 0.0) * (0.5 * y + v)
        return noise + 100.0 * (one * x + other * y + mute) + further * w + z[0] * u

    return Stated(
        residuals, [effect(name) for name in known], learns=True, limit=LIMIT,
        diverging=diverging or (lambda effects, noise: False),
    )  # fmt: skip


def found_beside(stated, told=None):
    report = [] if told is None else told
    return beside_nominal(stated, causes_of(stated), report.append)


def test_two_causes_are_found_that_only_together_explain_the_runs():
    stated, told = vehicle(), []
    for alone in (LARGE, SMALL):
        point = Point(stated.start.z, {size_of(alone): 0.5})
        assert disturbance_at_limit(fit(stated, (alone,), point))
    found = found_beside(stated, told)
    assert found.causes == (LARGE, SMALL)
    assert not disturbance_at_limit(found.fit)
    sizes = [abs(found.fit.point.effects[size_of(name)]) for name in (LARGE, SMALL)]
    assert sizes == pytest.approx([0.8, 0.4], abs=0.02)
    assert told[0].endswith("beside the nominal model")
    assert told[2].endswith(f"beside {LARGE}")


def test_one_cause_is_enough_where_its_fit_is():
    assert found_beside(vehicle(small=0.0)).causes == (LARGE,)


def test_nothing_is_found_where_causes_do_not_make_the_disturbance_plausible():
    told = []
    assert found_beside(vehicle(further=2.0 * LIMIT), told) is None
    assert sum(step.startswith("trying") for step in told) == POLICY.most_beside_nominal


def test_nothing_is_fitted_where_no_cause_makes_the_runs_likelier():
    told = []
    assert found_beside(vehicle(known=(IDLE,)), told) is None
    assert len(told) == 1


def test_settings_that_diverge_are_passed_over():
    def diverging(effects, noise):
        return effects.get(size_of(LARGE), 0.0) > 0.0 or effects.get(size_of(IDLE), 0.0) != 0.0

    found = found_beside(vehicle(diverging=diverging))
    assert found.causes == (LARGE, SMALL)
    assert found.fit.point.effects[size_of(LARGE)] == pytest.approx(-0.8, abs=0.02)


def attributed(stated):
    """What a search has found that ended with nothing."""
    nothing = Explanation((), fit(stated))
    shown = screen(nothing.fit, causes_of(stated), np.random.default_rng(0))
    return Attribution(nothing, shown, shown, nothing, (), (), 0.0)


def test_the_search_goes_on_from_there():
    stated = vehicle()
    before = attributed(stated)
    rng = np.random.default_rng(0)
    found = searched_afresh(before, causes_of(stated), rng, lambda step: None)
    assert set(found.accepted.causes) == {LARGE, SMALL}
    assert found.baseline is before.baseline
    assert found.accepted.score < before.accepted.score


@pytest.mark.parametrize("settings", [{"further": 2.0 * LIMIT}, {"known": (IDLE,)}])
def test_what_was_found_before_stays_where_nothing_better_is(settings):
    stated = vehicle(**settings)
    before = attributed(stated)
    rng = np.random.default_rng(0)
    assert searched_afresh(before, causes_of(stated), rng, lambda step: None) is before
