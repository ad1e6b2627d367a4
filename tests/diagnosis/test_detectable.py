"""Published sizes on a problem with known signals that bend, saturate, hide or never fade."""

from collections.abc import Callable

import numpy as np
import pytest

from fish_env.inference.detectability import (
    Setting,
    changes,
    in_proportion,
    noncentrality,
    simulated,
)
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import Cause, effect_values
from fish_env.inference.projection import Projector
from fish_env.inference.screening import Screen
from fish_env.model.effect import Effect, EffectParameter
from tests.inference.stated import Stated, fit_of, signal_of

SIZE, THRESHOLD, STEP = 600, -7.5, 0.01
RNG = np.random.default_rng(4)
SLOPES = RNG.standard_normal((SIZE, 2))
ALONG, ACROSS = 3.0 * RNG.standard_normal((2, SIZE))
PATH = EffectParameterId("extra", "size")


def stated(change: Callable, fastest: Callable | None = None) -> Stated:
    """Residuals that an effect and two coefficients change as a function says."""
    parameter = EffectParameter("size", "-", 0.0, 0.0, 1e3)
    effect = Effect("extra", "hydrodynamics", "", "", "", (parameter,), time_scale=fastest)
    return Stated(
        lambda z, effects: change(z, effects[PATH])[None], [effect], ("a", "b"), step=STEP
    )  # fmt: skip


def followed(z):
    return SLOPES @ z


def prepared(change: Callable, probe: float = 1.0, fastest: Callable | None = None):
    """Fit, screen, and the one setting, whose signal comes from a probe."""
    problem = stated(change, fastest)
    residuals = change(np.zeros(2), 0.0)
    slopes = np.stack([change(step, 0.0) - residuals for step in 1e-4 * np.eye(2)], 1) / 1e-4
    lines = Linearised(residuals, slopes, np.zeros(SIZE, np.int64), np.linspace(0.0, 90.0, SIZE))
    fit = fit_of(problem, linearised=lines)
    cause = Cause("extra", (({"size": probe},),))
    column = (change(np.zeros(2), probe) - residuals)[:, None]
    signal = Projector(fit).signal(cause, 0, column)
    return fit, Screen((signal,), THRESHOLD, 0.05), Setting(signal, 0, "size", 0.0)


def published(change: Callable, probe: float = 1.0, fastest: Callable | None = None):
    """Sizes by simulation and by proportion."""
    fit, screen, setting = prepared(change, probe, fastest)
    multiples = (*simulated(fit, screen, [setting]), *in_proportion([setting], THRESHOLD))
    return tuple(setting.size(m) for m in multiples)


def least_energy(change: Callable, size: float) -> float:
    """What the best refit leaves of an effect of some size, by brute force."""
    from scipy.optimize import minimize

    still = change(np.zeros(2), 0.0)

    def left(z):
        return float(np.sum((change(z, size) - still) ** 2) + z @ z)

    return float(minimize(left, np.zeros(2), method="Nelder-Mead", tol=1e-8).fun)


def needed(change: Callable) -> float:
    """Noncentrality that the screen's test of one setting needs."""
    _, _, setting = prepared(change)
    information = float(setting.signal.projected[0, 0]) / setting.signal.variance_inflation
    return information * float(in_proportion([setting], THRESHOLD)[0]) ** 2


def straight(z, d):
    return followed(z) + 0.01 * d * ALONG


def saturating(z, d):
    return followed(z) + 0.5 * np.tanh(d / 5.0) * ALONG


def turning(z, d):
    return followed(z) + 0.5 * (d * ALONG + d**2 * ACROSS)


def same_as_a_coefficient(z, d):
    a = z[0] + d
    return 3.0 * (SLOPES[:, 0] * a + 0.1 * a**2 * ALONG) + SLOPES[:, 1] * z[1]


def never_fading(z, d):
    return followed(z) + (0.1 * d * ALONG + ACROSS if d > 0 else 0.0)


def fading_late(z, d):
    return followed(z) + (0.5 * d * ALONG + 0.1 * ACROSS if d > 0 else 0.0)


def hidden_below(z, d):
    return followed(z) + 0.5 * max(d - 0.4, 0.0) * ALONG


def test_a_signal_in_proportion_is_found_at_the_size_in_proportion():
    by_simulation, by_proportion = published(straight)
    assert by_simulation == pytest.approx(by_proportion, rel=1e-3)


@pytest.mark.parametrize("probe", [0.5, 20.0])
def test_the_size_does_not_depend_on_a_probe_far_beyond_it(probe):
    """A saturated probe makes proportion publish several times too much."""
    by_simulation, by_proportion = published(saturating, probe)
    assert least_energy(saturating, by_simulation) == pytest.approx(needed(saturating), rel=0.12)
    if probe == 20.0:
        assert by_proportion > 3.0 * by_simulation


def test_a_probe_that_looks_elsewhere_finds_less():
    """At the published size the test of that probe, not an ideal one, has the power."""
    fit, screen, setting = prepared(turning, 2.0)
    (multiple,) = simulated(fit, screen, [setting])
    (change,) = changes(fit, [("extra", setting.probe(multiple))])
    assert noncentrality(screen, setting, change) == pytest.approx(needed(turning), rel=0.1)
    ideal = least_energy(turning, setting.size(multiple))
    assert ideal > 1.5 * needed(turning)


def test_what_a_coefficient_can_do_as_well_is_not_seen_in_the_bend_of_its_curve():
    """Its tangent leaves the bend; a refit does not, and only the prior is left to object."""
    fit, _, setting = prepared(same_as_a_coefficient)
    projector, size = Projector(fit), 1.5
    by_tangent = same_as_a_coefficient(np.zeros(2), size) - fit.linearised.residuals
    (by_curve,) = changes(fit, [("extra", setting.probe(size))])
    tangent, curve = (
        float(projector.signal(setting.signal.cause, 0, change[:, None]).projected[0, 0])
        for change in (by_tangent, by_curve)
    )
    assert curve == pytest.approx(least_energy(same_as_a_coefficient, size), rel=0.1)
    assert tangent > 10.0 * curve
    by_simulation, by_proportion = published(same_as_a_coefficient)
    assert by_simulation > np.sqrt(needed(same_as_a_coefficient)) > 2.0 * by_proportion


def test_a_signal_that_does_not_fade_is_published_from_its_probe():
    assert published(never_fading)[0] == pytest.approx(1.0)
    by_simulation, by_proportion = published(fading_late)
    assert by_simulation == pytest.approx(by_proportion, rel=0.1)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("probe", [0.6, 1.0, 5.0])
def test_an_effect_that_does_nothing_at_first_is_published_where_it_begins_to(probe):
    by_simulation, by_proportion = published(hidden_below, probe)
    assert by_proportion < 0.4
    found = least_energy(hidden_below, by_simulation) / needed(hidden_below)
    assert 0.5 < found < 2.0


def test_no_size_is_published_that_the_simulation_is_too_coarse_for():
    assert published(straight)[0] > 0.09
    coarse = published(lambda z, d: straight(z, 1e3 * d), 0.1, lambda values: values["size"] or 1.0)
    assert coarse[0] == pytest.approx(0.9 * STEP, rel=0.05)
    assert coarse[1] < coarse[0]


def test_settings_keep_the_shape_of_their_probe_and_turn_round_at_infinity():
    cause = Cause("limit", (({"rate": 8.0, "shape": 3.0},),))
    signal = signal_of(cause, 0.0)
    setting = Setting(signal, 0, "rate", np.inf)
    assert setting.probe(4.0) == {"rate": 4.0, "shape": 3.0}
    assert setting.size(0.25) == 16.0
    fit, _, _ = prepared(straight)
    assert effect_values(fit.problem, "extra", {}) == {PATH: 0.0}


def test_a_setting_tested_alone_is_found_sooner_than_among_six():
    """The best of both tests counts, each by what its degrees of freedom ask for."""
    fit, _, setting = prepared(straight)
    others = 3.0 * np.random.default_rng(5).standard_normal((SIZE, 5))
    probes = ({"size": 1.0},) * 6
    cause = Cause("extra", (probes, (probes[0],)))
    columns = np.column_stack([setting.signal.left, others])
    joint = Projector(fit).signal(cause, 0, columns)
    (change,) = changes(fit, [("extra", {"size": 1.0})])
    among, alone = (
        noncentrality(Screen(signals, THRESHOLD, 0.05), setting, change)
        for signals in ((joint,), (joint, setting.signal))
    )
    ratio = np.sqrt(alone / among)
    assert 1.15 < ratio < 1.35
    sizes = [in_proportion([Setting(s, 0, "size", 0.0)], THRESHOLD)[0]
             for s in (joint, setting.signal)]  # fmt: skip
    assert sizes[0] / sizes[1] == pytest.approx(ratio, rel=0.03)
