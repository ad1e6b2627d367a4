"""What speaks for an explanation does not depend on the words it is given in."""

import numpy as np
import pytest

from fish_env.inference.adequacy import implausible_estimates
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.problem import Point
from fish_env.inference.rivals import agreed, ranked
from tests.inference.stated import SIZE, Stated, effect, size_of

SHAPE = (4, 60)
LOW, HIGH = 0.1, 1.0


def stiff(neutral, plausible):
    """A spring, by how it gives way (off at zero) or by its stiffness (off at infinity)."""
    lower = 1e-3 if np.isinf(neutral) else 0.0
    return DeclaredEffect(
        "spring", (EffectParameter(SIZE, "-", neutral, lower, np.inf, plausible),)
    )


def explained(declared, gives, begin):
    """A fit of the spring, of which the data show how it gives way."""
    x, noise = np.random.default_rng(3).standard_normal((2, *SHAPE))

    def residuals(z, effects):
        return noise + 3.0 * (0.8 - gives(effects[size_of("spring")])) * x

    stated = Stated(residuals, [declared])
    point = Point(stated.start.z, {size_of("spring"): begin})
    return Explanation(("spring",), fit(stated, ("spring",), point))


def test_what_is_off_at_infinity_has_the_evidence_of_its_inverse():
    by_compliance = explained(stiff(0.0, (1.0 / HIGH, 1.0 / LOW)), lambda c: c, 1.0)
    by_stiffness = explained(stiff(np.inf, (LOW, HIGH)), lambda k: 1.0 / k, 1.0)
    (compliance,), (stiffness,) = (
        e.fit.point.effects.values() for e in (by_compliance, by_stiffness)
    )
    assert compliance * stiffness == pytest.approx(1.0, rel=1e-2)
    assert by_stiffness.score == pytest.approx(by_compliance.score, abs=0.1)


def same_by(*reaches):
    """Explanations by effects of these reaches, each of which does all there is to do."""
    x, noise = np.random.default_rng(5).standard_normal((2, *SHAPE))
    names = [f"reach {reach}" for reach in reaches]

    def residuals(z, effects):
        return noise + (15.0 - sum(effects[size_of(name)] for name in names)) * x

    stated = Stated(residuals, [effect(n, r) for n, r in zip(names, reaches, strict=True)])
    return [Explanation((name,), fit(stated, [name])) for name in names]


def test_of_equals_one_with_plausible_estimates_leads():
    wild, sober = same_by(1.0, 20.0)
    assert implausible_estimates(wild.fit)
    assert not implausible_estimates(sober.fit)
    assert wild.score < sober.score
    assert ranked([wild, sober]) == ranked([sober, wild]) == [sober, wild]


def test_a_better_explanation_leads_whatever_its_estimates():
    wild, sober = same_by(1.0, 2e4)
    assert wild.score < sober.score - 6.0
    assert ranked([sober, wild]) == [wild, sober]


@pytest.mark.parametrize(
    ("left", "expected"),
    [
        ((4.0, 4.0, 4.0, 4.0), True),
        ((4.0, 4.0, 4.0, 60.0), True),
        ((1.0, 1.0, 1.0, 60.0), False),
        ((-4.0, 4.0, 0.0, 60.0), False),
    ],
)
def test_runs_agree_where_each_tells_or_all_tell_alike(left, expected):
    """However much more one of them tells than the others."""

    def residuals(z, effects):
        best, other = (effects[size_of(name)] for name in ("best", "other"))
        return np.column_stack([np.full(4, 1e3 * (1.0 - best - other)), other * np.array(left)])

    stated = Stated(residuals, [effect("best", 1.0), effect("other", 1.0)])
    best, other = (Explanation((name,), fit(stated, [name])) for name in ("best", "other"))
    assert agreed(best, other) == expected
