"""A screen tries a few shapes of an effect; a fit begins with one that was looked at closer."""

import numpy as np
import pytest

from fish_env.inference.around import nearer
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import screen, zoomed
from fish_env.inference.starts import starts
from tests.inference.stated import Stated

PLACES = np.linspace(-1.0, 1.0, 60)
WIDTH, WHERE = 0.3, -0.62
STRENGTH, CENTRE = (EffectParameterId("bump", name) for name in ("strength", "centre"))
BUMP = DeclaredEffect(
    "bump",
    (
        EffectParameter("strength", "N", 0.0, 0.0, plausible=(0.0, 10.0)),
        EffectParameter("centre", "m", 0.0, plausible=(-2.0, 2.0), shapes=True),
    ),
)


@pytest.fixture(scope="module")
def problem():
    """Runs past a narrow bump, whose centre is between the places that a screen tries."""
    noise = 0.5 * np.random.default_rng(0).standard_normal((4, len(PLACES)))

    def residuals(z, effects):
        bump = effects[STRENGTH] * np.exp(-(((PLACES - effects[CENTRE]) / WIDTH) ** 2))
        true = 6.0 * np.exp(-(((PLACES - WHERE) / WIDTH) ** 2))
        return noise + bump - true + 0.0 * z[0]

    return Stated(residuals, [BUMP])


def shown(problem):
    own = fit(problem)
    return own, screen(own, causes_of(problem), np.random.default_rng(0)).best()[0]


def centre(signal):
    return signal.cause.probes[signal.probe][0]["centre"]


def test_a_fit_begins_close_to_the_right_shape(problem):
    own, signal = shown(problem)
    assert abs(centre(signal) - WHERE) > 0.5
    closer = zoomed(own, signal)
    assert centre(closer) == pytest.approx(WHERE, abs=0.13)
    assert closer.log_p < 3.0 * signal.log_p
    (first, *_) = starts(own, signal)
    assert first.effects[CENTRE] == centre(closer)
    assert first.effects[STRENGTH] == pytest.approx(6.0, abs=1.0)


def test_from_there_it_finds_what_it_would_miss_from_the_screened_shape(problem):
    own, signal = shown(problem)
    fitter = CoarseFitter(own)
    found = fitter.coarse_fit(("bump",), (), starts(own, signal))
    assert found.point.effects[CENTRE] == pytest.approx(WHERE, abs=0.03)


@pytest.mark.parametrize("share", [0.25, 0.06])
def test_shapes_stay_within_what_is_plausible(share):
    moved = nearer(BUMP, ({"strength": 1.0, "centre": 1.9},), share)
    assert sorted(own["centre"] for (own,) in moved) == pytest.approx([1.9 - 4.0 * share, 1.9, 2.0])
    assert {own["strength"] for (own,) in moved} == {1.0}


def test_without_a_shape_nothing_is_nearer():
    plain = DeclaredEffect("push", (EffectParameter("force", "N", 0.0, plausible=(0.0, 1.0)),))
    assert nearer(plain, ({"force": 0.1},), 0.25) == ()
