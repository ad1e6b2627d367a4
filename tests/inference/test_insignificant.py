"""Beside the others, a cause has to be as significant as the search asked for."""

import numpy as np
import pytest
from scipy.stats import norm

from fish_env.inference.elimination import log_p_of, log_p_of_departure, without_insignificant
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import Coefficient
from tests.inference.stated import Stated, effect, size_of

RUNS, SAMPLES = 4, 60
LAG, WRONG = "lag", Coefficient("c")
THRESHOLD = -11.0


def explained(off, does=lambda c: c, causes=(LAG, WRONG)):
    """A fit of an effect and a released coefficient.

    Args:
        off: departure of the coefficient, in standard deviations of its prior.
        does: what it does to the residuals, at a value of it.
        causes: those of the explanation.
    """
    rng = np.random.default_rng(4)
    x, y, noise = rng.standard_normal((3, RUNS, SAMPLES))

    def residuals(z, effects):
        lag = 0.5 - effects.get(size_of(LAG), 0.0)
        return noise + 20.0 * lag * x + (does(off) - does(z[0])) * y

    stated = Stated(residuals, [effect(LAG)])
    names = [name for name in causes if name != WRONG]
    return Explanation(tuple(causes), fit(stated, names, released=(WRONG,)))


@pytest.mark.parametrize(
    ("off", "left"), [(3.0, (LAG,)), (8.0, (LAG, WRONG))], ids=["ordinary", "wrong"]
)
def test_a_coefficient_beside_effects_stays_if_its_prior_excludes_it(off, left):
    told = []
    current = explained(off)
    found = without_insignificant(current, lambda others: THRESHOLD, told.append)
    assert found.causes == left
    assert bool(told) == (found is not current)
    assert found.fit.point.z[0] == pytest.approx(off, abs=0.3)  # also within its prior


def test_the_p_value_counts_the_prior_and_the_error():
    current = explained(3.0)
    baseline, number = current.fit.problem.baseline, current.fit.ids.index(WRONG)
    variance = baseline.sd[0] ** 2 + current.fit.covariance[number, number]
    sds = current.fit.estimates[number] / np.sqrt(variance)
    assert 2.5 < sds < 3.1
    assert log_p_of_departure(current.fit, WRONG) == pytest.approx(np.log(2.0 * norm.sf(sds)))


@pytest.mark.parametrize(("size", "left"), [(0.2, ("lag",)), (0.5, ("lag", "weak"))])
def test_an_effect_beside_others_has_to_be_significant(size, left):
    """A standard error of 0.065: that is 3.1 of them, which an interval excludes, and 7.7."""
    rng = np.random.default_rng(7)
    x, y, noise = rng.standard_normal((3, RUNS, SAMPLES))

    def residuals(z, effects):
        lag, weak = (effects.get(size_of(name), 0.0) for name in (LAG, "weak"))
        return noise + 20.0 * (0.5 - lag) * x + (size - weak) * y

    stated = Stated(residuals, [effect(LAG), effect("weak")])
    current = Explanation((LAG, "weak"), fit(stated, (LAG, "weak")))
    assert log_p_of(current.fit, "weak") < np.log(0.05)
    assert without_insignificant(current, lambda others: THRESHOLD, [].append).causes == left


def test_without_effects_a_coefficient_is_judged_by_the_search_alone():
    current = explained(3.0, causes=(WRONG,))
    assert without_insignificant(current, lambda others: THRESHOLD, [].append) is current


def test_a_coefficient_that_a_fit_needs_stays():
    """Its estimate tells little where it hardly acts; its prior would take it to where it does."""
    current = explained(9.0, lambda c: 0.02 * c + 20.0 * min(c - 6.0, 0.0))
    assert log_p_of_departure(current.fit, WRONG) > THRESHOLD
    told = []
    assert without_insignificant(current, lambda others: THRESHOLD, told.append) is current
    assert told
