"""A cause that others make needless, or that may as well not act, is dropped."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.inference.attribution import Attribution, settled
from fish_env.inference.elimination import allowed_loss, backward_elimination, may_not_act
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.problem import Point
from fish_env.inference.screening import Screen
from tests.inference.stated import Stated, apart, effect, fit_of, size_of


def fit_with(name, values, sd, correlation=0.0):
    count = len(values)
    problem = Stated(lambda z, effects: np.zeros((1, 1)), [catalogue()[name]])
    own = np.outer(sd, sd) * (np.eye(count) * (1 - correlation) + correlation)
    covariance = np.eye(count + 1)
    covariance[1:, 1:] = own
    found = {"estimates": np.r_[0.0, values], "covariance": covariance}
    return fit_of(problem, (name,), **found)


@pytest.mark.parametrize(
    ("fit", "idle"),
    [
        (fit_with("block_scale", [0.989], [0.0148]), True),
        (fit_with("block_scale", [0.95], [0.0148]), False),
        (fit_with("current", [0.02, 0.0, 0.0], [0.005, 0.005, 0.005]), False),
        (fit_with("current", [0.008, 0.0, 0.0], [0.005, 0.005, 0.005]), True),
        (fit_with("current", [0.007, 0.007, -0.007], [0.005] * 3, 0.0), True),
        (fit_with("current", [0.007, -0.007, 0.0], [0.005] * 3, 0.9), False),
        (fit_with("servo_rate_limit", [6.0], [9.0]), True),
        (fit_with("servo_rate_limit", [6.0], [2.0]), False),
        (fit_with("wave", [1e-3, 0.4, 1.0, 2.0, 1.5], [1e-3, 1e-6, 1e-6, 1e-6, 1e-6]), True),
    ],
    ids=["scale", "far", "current", "weak", "all weak", "together", "infinite", "finite", "shapes"],
)
def test_a_region_that_holds_its_absence_shows_nothing(fit, idle):
    """All that switches a cause on counts together; where and when it acts does not."""
    assert may_not_act(fit, fit.effects[0]) is idle


@pytest.mark.parametrize(("sd", "idle"), [(0.04, False), (0.06, True)])
def test_a_coefficient_is_off_at_its_nominal_value(sd, idle):
    problem = Stated(lambda z, effects: np.zeros((1, 1)), paths=("tail.area", "mass.total"))
    problem.baseline.mean[1] = 2.0
    own = fit_of(problem, estimates=np.array([0.0, 2.1]), covariance=np.diag([1.0, sd**2]))
    assert may_not_act(own, Coefficient("mass.total")) is idle


@pytest.mark.parametrize(("wider", "kept"), [(3.0, ("current",)), (1.0, ("current", "scale"))])
def test_an_idle_cause_is_dropped_whatever_its_evidence(wider, kept):
    """Evidence takes the residuals for white; the region is wider where they are coloured."""
    problem = Stated(
        apart({"current": [9.0], "scale": [5.0]}), [effect("current"), effect("scale")]
    )
    own = fit(problem, ("current", "scale"), refit_noise=False)
    both = Explanation(("current", "scale"), replace(own, covariance=own.covariance * wider**2))
    assert fit(problem, ("current",), refit_noise=False).objective - own.objective > 20.0
    assert backward_elimination(both)[0].causes == kept


def test_what_the_evidence_does_not_need_is_dropped_though_it_may_act():
    problem = Stated(
        apart({"current": [9.0], "scale": [2.2]}), [effect("current"), effect("scale")]
    )
    both = Explanation(("current", "scale"), fit(problem, ("current", "scale"), refit_noise=False))
    assert not may_not_act(both.fit, "scale")
    assert backward_elimination(both)[0].causes == ("current",)


def test_a_cause_stays_that_a_fit_misses_more_than_its_region_allows():
    """Far from neutral its size hardly matters, and nothing of that holds at neutral.

    So a rate limit acts whose torque limit may be infinite.
    """

    def residuals(z, effects):
        size = effects[size_of("limit")]
        return np.array([[9.0 * (1.0 - min(size, 1.0)), 0.1 * (size - 3.0), z.sum()]] * 3)

    problem = Stated(residuals, [effect("limit", 5.0)])
    own = fit(problem, ("limit",), Point(np.zeros(1), {size_of("limit"): 3.0}), refit_noise=False)
    found = Explanation(("limit",), own)
    assert may_not_act(own, "limit")
    assert allowed_loss(own, "limit") < 10.0
    assert backward_elimination(found)[0].causes == ("limit",)


NAMES = ("gain", "offset", "current")


@pytest.mark.parametrize(
    ("apart_by", "kept", "rivals"),
    [
        (0.05, {"gain", "current"}, [{"offset", "current"}]),  # as good: nobody knows which
        (1.0, {"gain", "current"}, []),  # the offset alone would miss the last sample
    ],
)
def test_one_of_two_look_alikes_goes_and_may_be_a_rival(apart_by, kept, rivals):
    """A larger stroke and a larger offset change all samples alike but one."""

    def residuals(z, effects):
        gain, offset, current = (effects[size_of(name)] for name in NAMES)
        row = np.r_[np.full(8, gain + offset - 8.0), apart_by * (gain - 8.0), current - 9.0, z]
        return np.tile(row, (4, 1))

    problem = Stated(residuals, [effect(name, 10.0) for name in NAMES])
    found = Explanation(NAMES, fit(problem, NAMES, refit_noise=False))
    best, others = backward_elimination(found)
    assert {*best.causes} == kept
    assert [{*other.causes} for other in others] == rivals


def attribution_of(accepted, rivals=()):
    """What a search has found; by its screens all that acts is significant."""
    screen = Screen((), 0.0, 0.05)
    return Attribution(accepted, screen, screen, accepted, tuple(rivals), (), 0.0)


@pytest.mark.parametrize("size", [0.3, 1.25], ids=["interval holds neutral", "evidence is weak"])
def test_nothing_is_published_that_converged_estimates_do_not_need(size):
    problem = Stated(
        apart({"current": [9.0] * 3, "scale": [size] * 3}), [effect("current"), effect("scale")]
    )
    far = Point(np.zeros(1), {size_of("current"): 9.0, size_of("scale"): 30.0})
    begun = fit(problem, ("current", "scale"), far, refit_noise=False, iterations=0)
    both = Explanation(("current", "scale"), begun)
    assert not may_not_act(begun, "scale")
    assert settled(attribution_of(both), False, print).accepted.causes == ("current", "scale")
    assert settled(attribution_of(both), True, print).accepted.causes == ("current",)


def test_nor_is_it_given_with_a_rival():
    targets = {"current": [9.0] * 3, "other": [9.0] * 3, "scale": [0.3] * 3}
    problem = Stated(apart(targets), [effect(name) for name in targets])
    best = Explanation(("other",), fit(problem, ("other",), refit_noise=False))
    names = ("current", "scale")
    rival = Explanation(names, fit(problem, names, refit_noise=False))
    found = settled(attribution_of(best, [rival]), True, print)
    assert [other.causes for other in found.rivals] == [("current",)]
