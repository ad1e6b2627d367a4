"""Effects that do nothing up to some size: a surface that is never touched by a smaller hull."""

import numpy as np
import pytest

from fish_env.inference.detectability import Setting, simulated
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.probes import causes_of, farthest, probes_of
from fish_env.inference.screening import screen
from fish_env.inference.search import refits
from tests.inference.stated import SIZE, Stated, effect, size_of

RUNS, SAMPLES, TRUE = 2, 80, 0.78
SURFACE, FORCE = "surface", "force"
NOTHING_UP_TO = 0.7


def problem(nothing_up_to=NOTHING_UP_TO, reach=1.0):
    """Runs with a surface that acts beyond a size, and with a force that is not there."""
    rng = np.random.default_rng(4)
    noise, x, y, w = rng.standard_normal((4, RUNS, SAMPLES))

    def acting(size):
        return np.sign(size) * max(abs(size) - nothing_up_to, 0.0)

    def residuals(z, effects):
        left = acting(TRUE) - acting(effects[size_of(SURFACE)])
        return noise + 20.0 * left * x - effects[size_of(FORCE)] * w - z[0] * y

    return Stated(residuals, [effect(SURFACE, reach, lower=0.0), effect(FORCE)])


def screened(stated):
    base = fit(stated, [])
    return base, screen(base, causes_of(stated), np.random.default_rng(0), keep_changes=True)


def test_no_usual_probe_shows_the_surface():
    sizes = [probe[SIZE] for (probe,) in probes_of(problem().known[SURFACE])]
    assert max(sizes) < NOTHING_UP_TO


def test_the_end_of_what_is_plausible_is_probed_where_less_does_nothing():
    base, found = screened(problem())
    best = found.best()[0]
    assert best.cause.id == SURFACE
    assert best.log_p < found.threshold
    there = fit(problem(), [SURFACE], start=base.point, noise=base.noise)
    assert there.point.effects[size_of(SURFACE)] == 0.0  # too flat to be left
    (probe,) = best.cause.probes[best.probe]
    assert probe[SIZE] == 1.0


def test_what_shows_is_not_probed_further():
    _, found = screened(problem(nothing_up_to=0.0))
    signals = [signal for signal in found.signals if signal.cause.id == SURFACE]
    assert all(signal.cause.probes == probes_of(problem().known[SURFACE]) for signal in signals)


def test_an_effect_that_does_nothing_anywhere_has_no_signal():
    _, found = screened(problem(nothing_up_to=2.0))
    assert SURFACE not in found.by_effect()


def test_the_smallest_size_that_is_found_is_beyond_those_that_do_nothing():
    base, found = screened(problem())
    signal = found.by_effect()[SURFACE]
    setting = Setting(signal, 0, SIZE, 0.0)
    (multiple,) = simulated(base, found, [setting])
    assert NOTHING_UP_TO < setting.size(multiple) < TRUE


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_no_farther_setting_is_probed_that_steps_do_not_follow(step):
    class Quick(type(effect(SURFACE))):
        def is_followed(self, values, step):
            return step < 0.02

    quick = Quick(SURFACE, effect(SURFACE).parameters)
    assert (farthest(quick, {SIZE: 0.1}, step) is None) == (step == 0.02)
    assert farthest(quick, {SIZE: 1.0}, 0.01) is None


def test_a_fit_begins_where_the_effect_does_something():
    """The linear estimate is too small to do anything, and still better than the far probe."""
    base, found = screened(problem())
    signal = found.by_effect()[SURFACE]
    assert float(signal.size[0]) < NOTHING_UP_TO
    (best, *_), _ = refits(Explanation((), base), [signal], [].append)
    assert best.fit.point.effects[size_of(SURFACE)] == pytest.approx(TRUE, abs=0.05)
