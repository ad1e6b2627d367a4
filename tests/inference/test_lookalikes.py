"""Lags that look alike: asked again in published steps, and not named where nothing decides."""

import numpy as np
import pytest
from scipy.signal import lfilter

from fish_env.inference.effects import EffectParameter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.lookalikes import (
    asked_of_lags,
    asked_of_rates,
    decided,
    late,
    rates,
    rates_asked_again,
    still_alike,
    undecided,
)
from fish_env.inference.probes import causes_of
from fish_env.inference.problem import Point
from fish_env.inference.rivals import rivals_of
from fish_env.inference.screening import screen
from fish_env.inference.vehicle import Drive
from tests.inference.stated import DeclaredEffect, Stated, effect, size_of

RUNS, SAMPLES = 4, 60
LAG, LIMIT = "lag", "limit"


def of_lags(residuals):
    """A problem with two lags that are known to look alike."""
    known = (effect(LAG, confusable_with=(LIMIT,)), effect(LIMIT, confusable_with=(LAG,)))
    stated = Stated(residuals, known)
    stated.hidden_by_drive, stated.drive = (LAG, LIMIT), Drive(uneven=True)
    return stated


def problem(share, lag=0.5, limit=0.0):
    """Runs in which one of two lags acts, or both.

    Args:
        share: how much of the one is like the other, as a correlation.
        lag: size of the first.
        limit: size of the second.
    """
    rng = np.random.default_rng(1)
    x, own, y = rng.standard_normal((3, RUNS, SAMPLES))
    noise = rng.standard_normal((RUNS, SAMPLES))
    like = share * x + np.sqrt(1.0 - share**2) * own

    def residuals(z, effects):
        left = (lag - effects[size_of(LAG)]) * x + (limit - effects[size_of(LIMIT)]) * like
        return noise + 20.0 * left - z[0] * y

    return of_lags(residuals)


def of_rates(share, **sizes):
    """The same of what makes a clock or a drive slow."""
    stated = problem(share, **sizes)
    stated.hidden_by_drive, stated.out_of_step = (), (LAG, LIMIT)
    return stated


def explained(stated, name):
    """A fit with one of the lags, and what its screen shows of the other."""
    current = Explanation((name,), fit(stated, [name]))
    return current, screen(current.fit, causes_of(stated), np.random.default_rng(0))


def test_each_lag_is_compared_with_those_known_to_look_like_it():
    current, _ = explained(problem(0.9), LIMIT)
    assert late(current) == [(LIMIT, LAG)]


def test_the_lag_that_fits_best_takes_the_place_of_another():
    best, alike = asked_of_lags(*explained(problem(0.9), LIMIT), [].append)
    assert best.causes == (LAG,)
    assert alike == ()


@pytest.mark.parametrize(("share", "fitted"), [(0.9, True), (0.5, False)], ids=["near", "far"])
def test_a_lag_that_explains_much_less_is_not_fitted(share, fitted):
    told = []
    best, alike = asked_of_lags(*explained(problem(share), LAG), told.append)
    assert (best.causes, alike) == ((LAG,), ())
    assert (f"trying {LIMIT} instead of {LAG}" in told) == fitted


def test_lags_that_fit_alike_are_rivals():
    best, alike = asked_of_lags(*explained(problem(1.0 - 1e-6), LAG), [].append)
    assert {best.causes, *(e.causes for e in alike)} == {(LAG,), (LIMIT,)}


def test_a_fit_with_another_lag_begins_where_a_coarse_one_has_led():
    """From the mildest probe, several times too large, its few steps did not come so far."""
    stated, time = problem(1.0 - 1e-6, lag=0.07), EffectParameterId(LIMIT, "time")
    plain, begun = stated.residuals, []
    timed = EffectParameter("time", "s", 0.0, plausible=(0.0, 1.0))
    stated.known = {
        **stated.known, LIMIT: DeclaredEffect(LIMIT, (timed,), confusable_with=(LAG,))
    }  # fmt: skip
    stated.residuals = lambda z, of: plain(z, {**of, size_of(LIMIT): of.get(time, 0.0)})
    stated.filtered = lambda point, *args: (
        begun.append(dict(point.effects)), Stated.filtered(stated, point, *args))[1]  # fmt: skip
    current, shown = explained(stated, LAG)
    begun.clear()
    asked_of_lags(current, shown, [].append)
    effects = next(effects for effects in begun if time in effects)
    assert effects[time] == pytest.approx(0.07, abs=0.02)


def test_all_that_fit_alike_are_rivals():
    names = (LAG, LIMIT, "third")
    rng = np.random.default_rng(3)
    x, noise = rng.standard_normal((2, RUNS, SAMPLES))
    like = {name: x + 1e-3 * rng.standard_normal(x.shape) for name in names}

    def residuals(z, effects):
        return noise + 20.0 * (0.5 * x - sum(effects[size_of(n)] * like[n] for n in names))

    known = [effect(n, confusable_with=tuple({*names} - {n})) for n in names]
    stated = Stated(residuals, known)
    stated.hidden_by_drive, stated.drive = names, Drive(uneven=True)
    best, alike = asked_of_lags(*explained(stated, LAG), [].append)
    assert {best.causes, *(e.causes for e in alike)} == {(name,) for name in names}


class LongSteps(Stated):
    """A problem in steps of a search, in which a fit of the published ones may diverge."""

    published: Stated

    is_coarse = True

    def in_usual_steps(self):
        return self.published


def test_a_lag_that_diverges_in_published_steps_leaves_its_place():
    usual = problem(0.9)
    usual.diverging = lambda effects, noise: size_of(LIMIT) in effects
    long = problem(0.9)
    long.__class__ = LongSteps
    long.published = usual
    best, alike = asked_of_lags(*explained(long, LIMIT), [].append)
    assert best.causes == (LAG,)
    assert best.fit.problem is usual
    assert alike == ()


@pytest.mark.parametrize(("share", "others"), [(0.95, [(LIMIT,)]), (0.5, [])])
def test_beside_the_unknown_a_lag_that_does_nearly_as_much_is_an_alternative(share, others):
    assert [e.causes for e in undecided(*explained(problem(share), LAG), [].append)] == others


def test_rates_are_compared_too():
    current, _ = explained(of_rates(0.9), LIMIT)
    assert rates(current) == [(LIMIT, LAG)]
    assert late(current) == []
    best, alike = asked_of_rates(*explained(of_rates(0.9), LIMIT), [].append)
    assert best.causes == (LAG,)
    assert alike == ()


def test_no_rate_wins_by_more_steps():
    """The fit of one ended far from its minimum, where one as good would explain more."""
    stated = of_rates(1.0 - 1e-6)
    far = Point(np.zeros(1), {size_of(LAG): 0.2})
    early = fit(stated, [LAG], far, iterations=0, refit_noise=False)
    other = fit(stated, [LIMIT])
    assert other.objective < early.objective
    _, shown = explained(stated, LAG)
    best, alike = asked_of_rates(Explanation((LAG,), early), shown, [].append)
    assert {best.causes, *(e.causes for e in alike)} == {(LAG,), (LIMIT,)}


@pytest.mark.parametrize(
    ("measured", "first"), [({}, 0.9), ({size_of(LIMIT): 0.7}, 0.7)], ids=["nothing", "it"]
)
def test_a_rate_takes_the_place_of_another_as_measured_or_at_its_size(measured, first):
    """From the mildest probe the fit would not come so far."""
    stated = of_rates(1.0 - 1e-6, lag=0.9)
    begun = []
    stated.filtered = lambda point, *args: (
        begun.append(dict(point.effects)), Stated.filtered(stated, point, *args))[1]  # fmt: skip
    current, shown = explained(stated, LAG)
    stated.drive = Drive(measured, uneven=True)
    begun.clear()
    asked_of_rates(current, shown, [].append)
    effects = next(effects for effects in begun if size_of(LIMIT) in effects)
    assert effects[size_of(LIMIT)] == pytest.approx(first, abs=0.05)


@pytest.mark.parametrize(
    ("share", "rivals"), [(1.0 - 1e-6, [(LIMIT,)]), (0.9, [])], ids=["alike", "told apart"]
)
def test_beside_the_unknown_a_rate_has_those_that_do_as_well_beside_it(share, rivals):
    best, alike = decided(*explained(of_rates(share), LAG), [].append)
    assert best.causes == (LAG,)
    assert [other.causes for other in alike] == rivals


def test_beside_the_unknown_a_rate_leaves_its_place_to_a_better_one():
    best, alike = decided(*explained(of_rates(0.9), LIMIT), [].append)
    assert (best.causes, alike) == ((LAG,), ())


def test_explanations_of_fewer_causes_are_rivals_and_not_the_same():
    stated = problem(0.5, lag=0.0)
    both = Explanation((LAG, LIMIT), fit(stated, [LAG, LIMIT]))
    one = Explanation((LAG,), fit(stated, [LAG]))
    assert rivals_of(both, [one]) == (one,)


def coloured(share):
    """Runs in which a lag acts, beside residuals that stay for long."""
    rng = np.random.default_rng(2)
    x, own, y, white = rng.standard_normal((4, RUNS, SAMPLES))
    noise = lfilter([1.0], [1.0, -0.9], white, axis=1)
    x, own = (lfilter([1.0], [1.0, -0.9], one, axis=1) for one in (x, own))
    like = share * x + np.sqrt(1.0 - share**2) * own

    def residuals(z, effects):
        left = (0.5 - effects[size_of(LAG)]) * x - effects[size_of(LIMIT)] * like
        return noise + 5.0 * left - z[0] * y

    return of_lags(residuals)


def test_residuals_of_one_colour_do_not_tell_lags_apart():
    """Were they white, the evidence would be decisive: it differs by 27."""
    stated = coloured(0.99)
    scores = [Explanation((name,), fit(stated, [name])).score for name in (LAG, LIMIT)]
    assert scores[1] - scores[0] > 20.0
    best, alike = asked_of_lags(*explained(stated, LAG), [].append)
    assert (best.causes, [e.causes for e in alike]) == ((LAG,), [(LIMIT,)])


def test_a_late_drive_is_compared_with_late_sensors():
    stated = problem(1.0 - 1e-6)
    stated.hidden_by_drive, stated.late_sensors = (LAG,), (LIMIT,)
    best, alike = asked_of_lags(*explained(stated, LAG), [].append)
    assert {best.causes, *(e.causes for e in alike)} == {(LAG,), (LIMIT,)}


def beside_another(share):
    """A problem with a further effect, and the explanations of two lags, each beside that."""
    stated = problem(share)
    plain = stated.residuals
    other = np.random.default_rng(5).standard_normal((RUNS, SAMPLES))
    stated.residuals = lambda z, effects: plain(z, effects) - effects[size_of("other")] * other
    stated.known = {**stated.known, "other": effect("other")}
    return [Explanation(names, fit(stated, names)) for names in ((LAG, "other"), (LIMIT, "other"))]


@pytest.mark.parametrize(("share", "alike"), [(1.0 - 1e-6, [(LIMIT,)]), (0.9, [])])
def test_a_rival_lag_is_asked_again_beside_fewer_causes(share, alike):
    before, rival = beside_another(share)
    fewer = Explanation((LAG,), fit(before.fit.problem, [LAG]))
    assert [e.causes for e in still_alike(fewer, before, [rival], [].append)] == alike


@pytest.mark.parametrize("share", [1.0 - 1e-6, 0.9])
def test_rates_are_compared_again_beside_another_cause(share):
    """What was left out in favour of a look-alike beside one cause may fit best beside the next."""
    right, wrong = beside_another(share)
    stated = right.fit.problem
    stated.out_of_step = (LAG, LIMIT)
    lone = [Explanation((name,), fit(stated, [name])) for name in (LIMIT, LAG)]
    best, alike = rates_asked_again(wrong, lone[0], [lone[1]], [].append)
    assert {best.causes, *(e.causes for e in alike)} >= {right.causes}
    assert (best.causes == right.causes) or share > 0.9
    assert rates_asked_again(right, lone[1], [], [].append) == (right, ())


def test_a_rival_lag_stays_one_beside_the_same_causes():
    before, rival = beside_another(1.0 - 1e-6)
    told = []
    assert still_alike(before, before, [rival], told.append) == (rival,)
    assert not told


def test_what_differs_in_more_than_a_lag_is_no_rival_lag():
    before, rival = beside_another(1.0 - 1e-6)
    alone = Explanation((LIMIT,), fit(before.fit.problem, [LIMIT]))
    crossed = Explanation(("other", LIMIT), rival.fit)
    assert still_alike(before, before, [alone, crossed], [].append) == ()
