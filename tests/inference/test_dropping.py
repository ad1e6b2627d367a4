"""Where a fit begins without a cause: where the linear model leads, or else where it was."""

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.in_place import begun_without
from tests.inference.stated import Stated, effect, size_of

A, B = "a", "b"
RUNS, SAMPLES = 3, 100


def alike(bend=0.0, diverging=lambda effects, noise: False):
    """Two effects that do nearly the same, a coefficient that does part of it, and white noise.

    Args:
        bend: of what the first effect does, with its square.
        diverging: tells where the simulation diverges.
    """
    rng = np.random.default_rng(0)
    x, y, other = rng.standard_normal((3, RUNS, SAMPLES))
    noise = 0.1 * rng.standard_normal((RUNS, SAMPLES))

    def residuals(z, effects):
        a, b = effects[size_of(A)], effects[size_of(B)]
        done = (a - bend * a**2) * x + b * (x + 0.3 * y) + 0.2 * z[0] * (y + other)
        return 10.0 * (done - 0.5 * x - 0.5 * (x + 0.3 * y) - noise)

    return Stated(residuals, (effect(A), effect(B)), diverging=diverging)


def both(stated):
    return fit(stated, (A, B), refit_noise=False, iterations=20)


def test_others_follow_a_cause_that_is_dropped():
    own = both(alike())
    runs, begin = begun_without(own, (B,), keep_in_step=False)
    alone = fit(own.problem, (A,), refit_noise=False, iterations=20)
    assert runs is own.problem
    assert begin.effects == (A,)
    assert begin.point.effects[size_of(A)] == pytest.approx(alone.point.effects[size_of(A)])
    assert begin.point.z == pytest.approx(alone.point.z, abs=1e-6)
    assert abs(begin.point.effects[size_of(A)] - own.point.effects[size_of(A)]) > 0.3


@pytest.mark.parametrize(
    "stated",
    [alike(diverging=lambda effects, noise: effects.get(size_of(A), 0.0) > 0.7), alike(bend=0.6)],
    ids=["diverges", "bends"],
)
def test_a_fit_begins_where_it_was_if_the_linear_model_leads_to_worse(stated):
    own = both(stated)
    _, begin = begun_without(own, (B,), keep_in_step=False)
    assert begin.point.effects[size_of(A)] == own.point.effects[size_of(A)]
