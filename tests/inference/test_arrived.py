"""A fit that is taken on before anything is asked of what it leaves."""

import numpy as np

from fish_env.inference.estimate.again import arrived
from fish_env.inference.estimate.fit import fit
from tests.inference.stated import SIZE, Stated, effect

TRUTH = 0.7


def started(iterations):
    """A fit of an effect whose residuals grow with the cube of its size."""
    x = np.random.default_rng(0).standard_normal((3, 60))

    def residuals(z, effects):
        size = sum(value for id, value in effects.items() if id.name == SIZE)
        return 30.0 * ((size + size**3) - (TRUTH + TRUTH**3)) * x + z[0]

    stated = Stated(residuals, (effect("bent"),))
    return fit(stated, ("bent",), refit_noise=False, iterations=iterations)


def test_a_fit_that_has_some_way_to_go_is_taken_on_to_its_minimum():
    early = started(1)
    there = arrived(early)
    assert there.objective < early.objective - 6.0
    assert abs(there.estimates[-1] - TRUTH) < 0.01 < abs(early.estimates[-1] - TRUTH)


def test_a_fit_that_has_arrived_stays_as_it_is():
    own = started(20)
    assert arrived(own) is own
