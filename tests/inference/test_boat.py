"""A second vehicle through the whole inference, without a line about fish."""

from functools import cache

import numpy as np
import pytest

from fish_env.inference.effort import QUICK
from fish_env.inference.estimate.fit import fit
from fish_env.inference.gain import gap_closed
from fish_env.inference.pipeline import infer, refit_baseline
from fish_env.inference.probes import causes_of
from fish_env.inference.result import Result
from fish_env.inference.screening import screen
from tests.inference.boat import COEFFICIENTS, EAST, NORTH, THRUST, sail, split
from tests.inference.boat import PROPELLER_WALK as WALK
from tests.inference.boat import RUDDER_BIAS as BIAS
from tests.inference.boat_problem import BoatNoise, BoatProblem

FITTED = 4
HIDDEN = [({BIAS: 0.03}, 0), ({WALK: -0.03}, 1), ({NORTH: 0.05, EAST: -0.1}, 2)]


def wind(state):
    """A wind from the north on a superstructure ahead of the middle."""
    heading = state[:, 2]
    return np.stack([-3.0 * np.cos(heading), 3.0 * np.sin(heading), 0.8 * np.sin(heading)], axis=1)


def problems(seed, effects=None, kept=2, **settings):
    """Runs to fit and runs kept for judging."""
    runs = sail(np.random.default_rng(seed), FITTED + kept, effects or {}, **settings)
    fitted, final = split(runs, FITTED)
    return BoatProblem(fitted), BoatProblem(final)


@cache
def found(case: int) -> Result:
    effects, seed = HIDDEN[case]
    return infer(*problems(seed, effects), seed=seed)


@pytest.mark.parametrize("case", range(len(HIDDEN)))
def test_each_hidden_effect_is_found_with_the_truth_in_its_interval(case):
    result, effects = found(case), HIDDEN[case][0]
    assert result.verdict.name == "cause"
    assert result.verdict.causes == (next(iter(effects)).effect,)
    estimates = result.estimates()
    assert estimates.keys() == effects.keys()
    for path, truth in effects.items():
        low, high = estimates[path].interval
        assert low < truth < high
        assert high - low < 0.3 * abs(truth)


@pytest.mark.parametrize("case", range(len(HIDDEN)))
def test_held_out_runs_are_predicted_down_to_the_noise(case):
    result = found(case)
    assert result.gap.share == pytest.approx(1.0, abs=0.1)
    assert result.gap.interval is None  # two runs make none


@pytest.mark.parametrize("case", range(len(HIDDEN)))
def test_the_gain_on_three_held_out_runs_has_an_interval(case):
    effects, seed = HIDDEN[case]
    fitted, final = problems(seed, effects, kept=3)
    baseline, accepted = (
        fit(fitted, names, rounds=2) for names in ((), (next(iter(effects)).effect,))
    )
    gap = gap_closed(final, baseline, accepted)
    assert gap.share == pytest.approx(1.0, abs=0.1)
    low, high = gap.interval
    assert low < gap.share < high


@pytest.mark.parametrize("case", range(len(HIDDEN)))
def test_the_error_budget_gives_the_hidden_effect_its_part(case):
    result = found(case)
    budget, causes = result.budget, result.verdict.causes
    assert budget.held_out
    shares = {share.name: share.share for share in budget.shares}
    assert shares.keys() == {"coefficients", *causes}
    assert shares[causes[0]] > 0.1
    assert budget.left < 0.1


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_named_where_nothing_is_hidden(seed):
    """The coefficients differ from the nominal ones as their priors say."""
    result = infer(*problems(seed + 50), seed=seed)
    assert (result.verdict.name, result.verdict.causes) == ("no_misfit", ())
    assert result.gap is None
    assert result.estimates() == {}


def test_two_effects_are_found_together():
    hidden = {BIAS: 0.03, NORTH: 0.1, EAST: 0.05}
    result = infer(*problems(5, hidden), seed=5)
    assert set(result.verdict.causes) == {"rudder_bias", "current"}
    for path, truth in hidden.items():
        assert result.estimates()[path].value == pytest.approx(truth, abs=0.003)


def test_a_wrong_coefficient_is_named_as_one():
    mean, share, _ = COEFFICIENTS["thrust"]
    result = infer(*problems(6, coefficients={THRUST: mean * (1.0 + 7.0 * share)}), seed=6)
    assert result.verdict.name == "parameters"
    assert THRUST in result.verdict.causes
    assert result.estimates()[THRUST].value == pytest.approx(1.7 * mean, rel=0.1)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_foreign_force_is_outside_the_library(seed):
    result = infer(*problems(seed, foreign=wind), seed=seed)
    assert result.verdict.name == "outside_library"
    strongest = result.adequacy.misfits[0]
    assert "heading" in strongest.function


def test_on_short_straight_runs_two_effects_cannot_be_told_apart():
    """At a steady speed a propeller's moment is that of a rudder amidships."""
    runs = sail(np.random.default_rng(3), 2, {BIAS: 0.02}, straight=True, duration=20.0)
    result = infer(BoatProblem(runs), seed=3)
    assert result.verdict.name == "ambiguous"
    named = {result.verdict.causes, *result.verdict.alternatives}
    assert named == {("rudder_bias",), ("propeller_walk",)}
    (shown,) = [p for p in result.preconditions if p.name == "rudder_bias"]
    assert shown.most_confusable[0] == "propeller_walk"
    assert shown.most_confusable[1] > 0.95


def test_a_drifting_boat_shows_nothing_of_rudder_and_propeller():
    result = infer(*problems(7, {BIAS: 0.03}, drifting=True), seed=7)
    assert result.verdict.name == "not_excited"
    excited = {p.name: p.excited for p in result.preconditions}
    assert excited == {"rudder_bias": False, "propeller_walk": False, "current": True}


def test_a_size_that_can_just_be_found_is_found_about_as_often():
    """Preconditions promise a power of 0.8 in the screen."""
    problem, _ = problems(8)
    baseline = refit_baseline(problem)
    causes = causes_of(problem)
    result = infer(problem, seed=8)
    (shown,) = [p for p in result.preconditions if p.name == "rudder_bias"]
    size = shown.smallest_detectable["offset"]
    truth = dict(zip(baseline.ids, baseline.estimates.tolist(), strict=True))
    seen = []
    for times in (0.3, 3.0):
        rng = np.random.default_rng(8)  # the same commands
        runs = sail(rng, FITTED + 2, {BIAS: times * size}, coefficients=truth)
        own = fit(BoatProblem(split(runs, FITTED)[0]), rounds=2)
        shown = screen(own, causes, np.random.default_rng(0))
        seen.append(any(s.log_p < shown.threshold for s in shown.best() if s.cause.is_effect))
    assert seen == [False, True]


def test_the_noise_is_estimated():
    problem, _ = problems(0)
    own = fit(problem, noise=BoatNoise(0.1, 0.1), rounds=2)
    assert own.noise.linear == pytest.approx(0.02, rel=0.3)
    assert own.noise.yaw == pytest.approx(0.01, rel=0.3)


def test_residuals_of_the_filter_are_those_of_its_lanes_and_white():
    problem, _ = problems(0)
    own = fit(problem, rounds=2)
    z, effects = own.point.z[:, None], {k: np.array([v]) for k, v in own.point.effects.items()}
    lanes = problem.innovations(z, effects, own.noise, own.filtered)[0]
    filtered = np.concatenate([f.residuals for f in own.filtered])
    np.testing.assert_allclose(lanes, filtered, atol=1e-9)
    assert np.mean(filtered**2) == pytest.approx(1.0, abs=0.07)


def test_a_quick_look_finds_a_strong_effect():
    result = infer(*problems(0, {BIAS: 0.05}), seed=0, effort=QUICK)
    assert result.verdict.causes == ("rudder_bias",)
