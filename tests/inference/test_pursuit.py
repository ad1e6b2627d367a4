"""Many causes at once, against fits made one after another and the whole normal equations."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fish_env.inference.attribution import attribute, extended
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.elimination import backward_elimination, insignificant
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.many_causes import challenged, each_in_turn
from fish_env.inference.pipeline import infer
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import causes_of
from fish_env.inference.progress import silent
from fish_env.inference.projection import Projector
from fish_env.inference.pursuit import picked, pursued, substitutes
from fish_env.inference.screening import Screen, screen
from fish_env.inference.tails import chi2_log_tail
from fish_env.inference.vehicle import Drive
from tests.inference.boat import sail, split
from tests.inference.boat_problem import BoatProblem
from tests.inference.stated import SIZE, Stated, apart, effect, size_of
from tests.inference.test_boat import BIAS, EAST, FITTED, NORTH, WALK

HIDDEN = {BIAS: 0.03, NORTH: 0.05, EAST: -0.1}
NAMES = {"rudder_bias", "current"}
NO_MORE = -20.0


@cache
def problem(seed: int = 3) -> BoatProblem:
    runs = sail(np.random.default_rng(seed), FITTED + 2, HIDDEN)
    return BoatProblem(split(runs, FITTED)[0])


@cache
def screened() -> tuple[Fit, Screen]:
    baseline = fit(problem())
    return baseline, screen(
        baseline, causes_of(problem()), np.random.default_rng(0), keep_changes=True
    )


def test_all_hidden_effects_are_picked_in_the_linear_model():
    baseline, shown = screened()
    picks = picked(Projector(baseline), shown, 8)
    assert {pick.signal.cause.id for pick in picks} >= NAMES
    assert [p.signal.cause.id for p in picked(Projector(baseline), shown, 1)] == [
        picks[0].signal.cause.id
    ]


def test_each_pick_explains_what_the_whole_normal_equations_say():
    """The evidence of the second, beside the first, by solving for everything at once."""
    baseline, shown = screened()
    projector = Projector(baseline)
    one, two = picked(projector, shown, 2)

    def explained(*signals):
        rows = np.hstack([s.left for s in signals])
        pulls = np.hstack([np.sqrt(projector.prior)[:, None] * s.followed for s in signals])
        score = np.concatenate([s.score for s in signals])
        return score @ np.linalg.solve(rows.T @ rows + pulls.T @ pulls, score)

    gain = explained(one.signal, two.signal) - explained(one.signal)
    expected = chi2_log_tail(gain / two.signal.variance_inflation, two.signal.freedom)
    assert two.log_p == pytest.approx(float(expected), rel=1e-3)


def test_a_screen_knows_the_products_of_its_signals_without_these():
    baseline, shown = screened()
    kept = shown.only(lambda signal: signal.cause.id in NAMES)
    rows = np.hstack([s.left for s in kept.signals])
    assert {s.cause.id for s in kept.signals} == NAMES
    assert kept.products == pytest.approx(rows.T @ rows, rel=1e-4, abs=1e-4)
    light = shown.without_changes()
    assert sum(s.left.size for s in light.signals) == 0
    projector = Projector(baseline)
    for few, whole in zip(picked(projector, light, 8), picked(projector, shown, 8), strict=True):
        assert few.signal.cause == whole.signal.cause
        assert few.log_p == whole.log_p


def test_effects_are_found_together_and_nothing_else():
    baseline, shown = screened()
    found = pursued(Explanation((), baseline), shown, silent)
    assert set(found.causes) == NAMES
    for path, truth in HIDDEN.items():
        low, high = found.fit.interval(path, 0.999)
        assert low < truth < high


def test_where_nothing_shows_nothing_is_fitted():
    baseline, shown = screened()
    nothing = Explanation((), baseline)
    assert pursued(nothing, shown, silent, relaxed_log_p=-1e12) is nothing


def test_an_effect_that_does_nothing_is_not_significant_beside_the_others():
    runs = sail(np.random.default_rng(7), FITTED, {BIAS: 0.03})
    both = fit(BoatProblem(runs), ("rudder_bias", "propeller_walk"))
    assert insignificant(both, ("rudder_bias", "propeller_walk"), NO_MORE) == ("propeller_walk",)


def test_a_substitute_costs_what_a_fit_with_it_loses():
    runs = sail(np.random.default_rng(7), FITTED, {BIAS: 0.03})
    boat = BoatProblem(runs)
    right = fit(boat, ("rudder_bias",))
    shown = screen(right, causes_of(boat), np.random.default_rng(0))
    costs = {s.name: s.cost for s in substitutes(Explanation(("rudder_bias",), right), shown)}
    for name in ("propeller_walk", "current"):
        wrong = fit(boat, (name,), noise=right.noise, refit_noise=False, iterations=10)
        loss = wrong.objective - right.objective
        inflation = {s.cause.id: s.variance_inflation for s in shown.best()}[name]
        assert costs[name] == pytest.approx(loss / inflation, rel=0.2)


def test_three_causes_are_named():
    runs = sail(np.random.default_rng(3), FITTED + 2, {**HIDDEN, WALK: -0.03})
    result = infer(*map(BoatProblem, split(runs, FITTED)), seed=3)
    assert set(result.verdict.causes) == {*NAMES, "propeller_walk"}
    assert result.verdict.alternatives == ()


def test_every_cause_is_doubted_before_one_is_doubted_again():
    """A small cause with many substitutes must not take all the trials."""
    close = [("gain", "lag"), ("gain", "loss"), ("gain", "wave"), ("delay", "lag"), ("play", "gap")]
    assert each_in_turn(close) == [
        ("gain", "lag"),
        ("delay", "lag"),
        ("play", "gap"),
        ("gain", "loss"),
        ("gain", "wave"),
    ]


def test_what_was_measured_of_a_drive_is_doubted_first():
    """A clock may show what a drive seems to do, however little the linear model says of it."""

    def residuals(z, effects):
        slow, clock = effects[size_of("slow")], effects[size_of("clock")]
        alike, apart = slow + clock - 5.0, 0.5 * slow - 0.3 * clock - 2.5
        return np.tile([alike, apart, float(z.sum())], (3, 1))

    known = [effect("slow", reach=10.0, confusable_with=("clock",)), effect("clock", reach=10.0)]
    problem = Stated(residuals, known)
    problem.out_of_step, said = ("slow", "clock"), []
    problem.drive = Drive({size_of("slow"): 5.0}, known=True, certain=True)
    measured = Explanation(("slow",), fit(problem, ("slow",)))
    shown = screen(measured.fit, causes_of(problem), np.random.default_rng(0))
    best, rivals = challenged(measured, shown, (), said.append)
    assert "trying clock instead of slow" in said
    assert best is measured
    assert not rivals


def test_a_cause_that_has_been_dropped_is_not_doubted():
    """It took the place of another, and was dropped beside causes found later."""
    problem = Stated(apart({"lag": [3.0] * 3, "gain": [0.0] * 3}), [effect("lag"), effect("gain")])
    problem.known = {**problem.known, "play": effect("play")}
    current = Explanation(("lag",), fit(problem, ("lag",)))
    shown, said = screen(current.fit, causes_of(problem), np.random.default_rng(0)), []
    dropped, taken = "play", "gain"
    best, _ = challenged(current, shown, (), said.append, [(dropped, taken)])
    assert best is current
    assert f"trying {taken} instead of {dropped}" not in said


class Both(DeclaredEffect):
    """An effect that does what two others do together."""

    def in_parts(self, values):
        return {"lag": {SIZE: values[SIZE]}, "delay": {SIZE: values[SIZE]}}


def test_a_cause_that_does_what_two_do_is_taken_apart():
    """Neither alone takes its place. Together they fit better."""

    def residuals(z, effects):
        lag, delay, both = (effects[size_of(name)] for name in ("lag", "delay", "both"))
        return np.tile([lag + both - 12.0, delay + both - 8.0, float(z.sum())], (3, 1))

    both = effect("both", 20.0)
    problem = Stated(
        residuals, [effect("lag", 20.0), effect("delay", 20.0), Both("both", both.parameters)]
    )
    current = Explanation(("both",), fit(problem, ("both",)))
    shown = screen(current.fit, causes_of(problem), np.random.default_rng(0))
    best, rivals = challenged(current, shown, (), lambda said: None)
    assert set(best.causes) == {"lag", "delay"}
    assert not rivals


@pytest.mark.parametrize("takes_apart", [False, True])
def test_what_a_cause_does_with_another_is_not_fitted_in_its_place(takes_apart):
    """The other would have shown."""

    def residuals(z, effects):
        lag, delay, both = (effects[size_of(name)] for name in ("lag", "delay", "both"))
        return np.tile([lag + both - 12.0, delay + 0.1 * both, float(z.sum())], (3, 1))

    lag = effect("lag", 20.0, confusable_with=("both",))
    both = effect("both", 20.0)
    if takes_apart:
        both = Both("both", both.parameters)
    problem, said = Stated(residuals, [lag, effect("delay", 20.0), both]), []
    current = Explanation(("lag",), fit(problem, ("lag",)))
    shown = screen(current.fit, causes_of(problem), np.random.default_rng(0))
    best, _ = challenged(current, shown, (), said.append)
    assert best is current
    assert "trying both instead of lag" in said
    assert ("fitting both" in said) != takes_apart


def test_what_is_like_a_cause_found_does_not_push_out_what_shows():
    """It comes beside what shows most, which is like none of both."""

    def residuals(z, effects):
        lag, delay, bias = (effects[size_of(name)] for name in ("lag", "delay", "bias"))
        saturating = 30.0 * np.tanh(bias / 10.0) - 90.0  # explains less than its slope says
        return np.tile([lag - 4.0, 2.0 * delay - 80.0, saturating, float(z.sum())], (3, 1))

    known = [effect("lag", 10.0, confusable_with=("delay",)), effect("delay", 80.0)]
    problem = Stated(residuals, [*known, effect("bias", 40.0)])
    current = Explanation(("lag",), fit(problem, ("lag",)))
    shown = screen(current.fit, causes_of(problem), np.random.default_rng(0))
    assert shown.best()[0].cause.id == "bias"
    said = []
    pursued(current, shown, said.append, most=1)
    assert "fitting delay, bias together" in said


def test_where_one_cause_alone_was_of_no_use_two_have_to_show():
    baseline, shown = screened()
    said = []
    nothing = Explanation((), baseline)
    alone = shown.only(lambda signal: signal.cause.id == BIAS.effect)
    assert pursued(nothing, alone, said.append, fewest=2) is nothing
    assert not said
    assert pursued(nothing, alone, said.append).causes == (BIAS.effect,)


def test_a_search_that_adds_nothing_fits_nothing_again():
    baseline, _ = screened()
    causes, rng = causes_of(problem()), np.random.default_rng(0)
    found = attribute(baseline, causes, rng)
    said = []
    assert set(found.accepted.causes) == NAMES
    assert extended(found, causes, rng, report=said.append) is found
    assert "removing unnecessary causes" not in said


@pytest.mark.parametrize(("size", "fitted"), [(4.0, False), (2.0, True)], ids=["plain", "open"])
def test_what_the_linear_model_foresees_to_be_needed_is_not_fitted_without(size, fitted):
    """Seven standard errors are plain, three and a half are not."""

    def residuals(z, effects):
        small, large = effects[size_of("small")] - size, effects[size_of("large")] - 40.0
        return np.tile([small, large, float(z.sum())], (3, 1))

    problem = Stated(residuals, [effect("small", 10.0), effect("large", 60.0)])
    current = Explanation(("small", "large"), fit(problem, ("small", "large")))
    problem.log.simulated.clear()
    kept, rivals = backward_elimination(current)
    assert (kept.causes, rivals) == (current.causes, ())
    assert any("small" not in effects for effects, _ in problem.log.simulated) == fitted


def hidden_in_a_trap(steep):
    """An effect whose small sizes are far worse than none, in runs that a coarse fit leaves out."""
    worse = ([0.0, 0.01, 3.6, 4.0], [0.0, 30.0 * steep, 30.0 * steep, 0.0])

    def residuals(z, effects):
        size, runs = effects[size_of("shy")], POLICY.coarse_fit_runs
        few = [5.0 * (3.4 - size), 0.0, float(z.sum())]
        other = [5.0 * (4.0 - size), float(np.interp(size, *worse)), float(z.sum())]
        chosen = {*np.linspace(0, 2 * runs - 1, runs).round().astype(int).tolist()}
        return np.array([few if run in chosen else other for run in range(2 * runs)])

    return Stated(residuals, [effect("shy", 8.0)])


@pytest.mark.parametrize("steep", [0.0, 1.0])
def test_a_fit_that_ends_where_it_began_is_made_again_from_the_sizes_of_the_coarse_one(steep):
    """From where the effect hardly acts no step leads to where it does."""
    stated = hidden_in_a_trap(steep)
    nothing = Explanation((), fit(stated, (), refit_noise=False))
    shown = screen(nothing.fit, causes_of(stated), np.random.default_rng(0))
    found = pursued(nothing, shown, silent)
    assert found.causes == ("shy",)
    assert found.fit.point.effects[size_of("shy")] == pytest.approx(3.8, abs=0.2)


@pytest.mark.parametrize("agreeing", [False, True])
def test_what_explains_more_in_one_run_only_does_not_lead_before_a_simpler_cause(agreeing):
    """Its second number makes up for an error of that run, and would beside the next cause too."""
    odd = np.full(4, 6.0) if agreeing else np.array([9.0, 0.0, 0.5, -0.5])

    def residuals(z, effects):
        lag, soft, bias = (effects[size_of(name)] for name in ("lag", "soft", "bias"))
        rings = effects[EffectParameterId("soft", "rings")] * (soft != 0.0)
        rows = [np.full(4, lag + soft - 40.0), np.full(4, bias - 8.0), rings - odd]
        return np.column_stack([*rows, np.full(4, z.sum())])

    lag, bias = effect("lag", 60.0, confusable_with=("soft",)), effect("bias", 10.0)
    rings = EffectParameter("rings", "-", 0.0, plausible=(-10.0, 10.0), shapes=True)
    soft = DeclaredEffect("soft", (*effect("soft", 60.0).parameters, rings), ("lag",))
    problem, said = Stated(residuals, [lag, soft, bias]), []
    rng = np.random.default_rng(0)
    found = attribute(fit(problem), causes_of(problem), rng, report=said.append)
    answers = [{*e.causes} for e in (found.accepted, *found.rivals)]
    assert ({"lag", "bias"} in answers) != agreeing
    assert ("going on with lag, which explains as much" in said) != agreeing
