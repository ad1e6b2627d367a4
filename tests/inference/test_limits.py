"""An effect that has another one as its limit is no rival where the data show no more than that."""

from math import inf

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectName, EffectParameterId
from fish_env.inference.limits import does_no_more
from fish_env.inference.rivals import rivals_of
from tests.inference.stated import SIZE, Stated, effect

SIMPLE, FULLER, END = "simple", "fuller", "end"


def known(contains):
    """An effect, and one that does the same beside what its end does."""
    end = EffectParameter(END, "-", 0.0, plausible=(-1.0, 1.0))
    size = EffectParameter(SIZE, "-", 0.0, plausible=(-1.0, 1.0), shapes=True)
    limit = {SIMPLE: {SIZE: 1.0}} if contains else {}
    return effect(SIMPLE), DeclaredEffect(FULLER, (end, size), parts=lambda values: limit)


def explained(end, contains, told=0.05):
    """Explanations by either effect of what one of them has done, with noise.

    Args:
        end: of the fuller effect.
        contains: whether it is known to have the other as its limit.
        told: how much the data tell of its end; little costs no evidence.
    """
    rng = np.random.default_rng(2)
    x, y, noise = rng.standard_normal((3, 4, 50))

    def residuals(z, effects):
        done = {(id.effect, id.name): value for id, value in effects.items()}
        size = done[SIMPLE, SIZE] + done[FULLER, SIZE]
        return 10.0 * ((size - 0.5) * x + told * (done[FULLER, END] - end) * y) + noise + z[0]

    stated = Stated(residuals, known(contains))
    return [
        Explanation((name,), fit(stated, (name,), refit_noise=False)) for name in (SIMPLE, FULLER)
    ]


@pytest.mark.parametrize("contains", [True, False])
def test_an_effect_at_its_limit_is_no_rival(contains):
    simple, fuller = explained(end=0.0, contains=contains)
    assert rivals_of(simple, [fuller]) == (() if contains else (fuller,))


def test_an_effect_beyond_its_limit_leads():
    simple, fuller = explained(end=0.5, contains=True, told=1.0)
    assert fuller.score < simple.score
    assert rivals_of(fuller, [simple]) == ()


@pytest.mark.parametrize(
    ("frequency", "damping", "than", "expected"),
    [
        (10.6, 1.6, "servo_lag", True),  # stiffer than any tail that bends
        (10.6, 0.5, "servo_lag", True),
        (6.0, 1.6, "servo_lag", False),  # one that bends
        (6.0, 0.3, "servo_lag", False),
        (10.6, 1.6, "servo_rate_limit", False),
        (inf, 1.6, "servo_lag", False),
    ],
)
def test_a_tail_too_stiff_to_bend_does_no_more_than_a_servo_that_lags(
    frequency, damping, than, expected
):
    stated = Stated(lambda z, effects: np.zeros((1, 2)), tuple(catalogue().values()))
    numbers = {"natural_frequency": frequency, "damping_ratio": damping}
    values = {EffectParameterId("tail_flexibility", k): v for k, v in numbers.items()}
    found = does_no_more(stated, EffectName("tail_flexibility"), values, EffectName(than))
    assert found is expected
