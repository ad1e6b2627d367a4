"""What runs share of their own numbers: an effect where they share it, none where none needs it."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.run_variation import CommonEffect, RunVariation
from fish_env.inference.explanation import Explanation
from fish_env.inference.in_common import Numbers, with_common_errors
from fish_env.inference.left_out import left_out_scores
from fish_env.inference.vehicle import Drive
from tests.inference.stated import SIZE, Numbered, White, effect, size_of

RUNS, SAMPLES, THRESHOLD = 6, 120, -8.0
ASKEW, DRIFT, TRIM = range(3)
MOUNTING, BALLAST, CLOCK = "mounting", "ballast", "clock"
TOGETHER = (1.0, -0.5)
"""By how much the clock changes the first and the last number."""


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (1.0, 1.0, 1.0)


class Sensed(Numbered):
    """Runs with three numbers, two of sensors and a trim.

    Effects do one of those, the trim, and both at once.

    Args:
        askew: (RUNS,) what the first number should be.
        trim: (RUNS,) what the last should be.
    """

    def __init__(self, askew, trim=0.0, seed=0):
        rng = np.random.default_rng(seed)
        self.x = rng.standard_normal((RUNS, SAMPLES, 3))
        self.y = rng.standard_normal((RUNS, SAMPLES))
        true = np.column_stack([np.broadcast_to(v, RUNS) for v in (askew, 0.0, trim)])
        self.data = np.einsum("rsk,rk->rs", self.x, true) + rng.standard_normal((RUNS, SAMPLES))
        self.own = np.zeros((RUNS, 3))
        self.variations = (
            RunVariation("askew", "rad", 1.0, shared=True),
            RunVariation("drift", "rad", 1.0, shared=True),
            RunVariation("trim", "m", 1.0),
        )
        self.common_effects = (
            CommonEffect(MOUNTING, ("askew",), lambda shared: {SIZE: shared[0]}),
            CommonEffect(BALLAST, ("trim",), lambda shared: {SIZE: shared[0]}),
            CommonEffect(
                CLOCK, ("askew", "trim"), lambda shared: {SIZE: shared[0]}, rates=TOGETHER
            ),
        )
        self.drive = Drive(uneven=True)
        super().__init__((effect(MOUNTING), effect(BALLAST), effect(CLOCK)))

    def left(self, z, effects):
        alone = np.array([effects[size_of(MOUNTING)], 0.0, effects[size_of(BALLAST)]])
        clock = effects[size_of(CLOCK)] * np.array([TOGETHER[0], 0.0, TOGETHER[1]])
        numbers = self.own + alone + clock
        return self.data - np.einsum("rsk,rk->rs", self.x, numbers) - z[0] * self.y

    def variation_slopes(self, point, noise, filtered, steps):
        return -self.x[self.which].reshape(-1, 3)


def explained(problem):
    return Explanation((), fit(problem, noise=Spreading(), refit_noise=False))


def test_what_all_runs_share_becomes_an_effect():
    current = explained(Sensed(0.8))
    found = with_common_errors(current, THRESHOLD, [].append)
    assert found.causes == (MOUNTING,)
    assert found.score < current.score
    assert found.fit.point.effects[size_of(MOUNTING)] == pytest.approx(0.8, abs=0.15)
    assert found.fit.noise.spread[ASKEW] == 0.0
    assert not found.fit.problem.variation[:, ASKEW].any()


def test_what_runs_share_of_a_trim_becomes_an_effect_and_the_rest_stays_theirs():
    own = 3.0 + 0.5 * np.random.default_rng(0).standard_normal(RUNS)
    found = with_common_errors(explained(Sensed(0.0, own)), THRESHOLD, [].append)
    assert found.causes == (BALLAST,)
    assert found.fit.point.effects[size_of(BALLAST)] == pytest.approx(3.0, abs=1.0)
    assert found.fit.noise.spread[TRIM] == 1.0
    moved = found.fit.problem.variation[:, TRIM] + found.fit.point.effects[size_of(BALLAST)]
    assert moved == pytest.approx(own, abs=0.3)


@pytest.mark.parametrize("seed", range(3))
def test_one_effect_that_moves_two_numbers_takes_the_place_of_two_effects(seed):
    own = 3.0 + 0.5 * np.random.default_rng(seed).standard_normal(RUNS)
    found = with_common_errors(explained(Sensed(own, -0.5 * own, seed)), THRESHOLD, [].append)
    assert found.causes == (CLOCK,)
    assert found.fit.point.effects[size_of(CLOCK)] == pytest.approx(3.0, abs=1.0)
    # What the numbers have beside it is theirs.
    assert found.fit.noise.spread == pytest.approx([1.0, 0.0, 1.0])
    for number, rate in ((ASKEW, 1.0), (TRIM, -0.5)):
        moved = (
            found.fit.problem.variation[:, number] + rate * found.fit.point.effects[size_of(CLOCK)]
        )
        assert moved == pytest.approx(rate * own, abs=0.3)


@pytest.mark.parametrize("seed", range(5))
def test_what_differs_from_run_to_run_stays_a_number(seed):
    own = 0.8 * np.random.default_rng(seed).standard_normal(RUNS)
    current = explained(Sensed(own, seed=seed))
    found = with_common_errors(current, THRESHOLD, [].append)
    assert found.causes == ()
    assert found.fit.noise.spread[ASKEW] == 1.0


@pytest.mark.parametrize("seed", range(5))
def test_numbers_that_none_needs_go_and_those_of_single_runs_stay(seed):
    current = explained(Sensed(0.0, seed=seed))
    numbers = Numbers(current.fit)
    assert numbers.in_common() == []
    assert sorted(numbers.unneeded()) == [ASKEW, DRIFT]
    found = with_common_errors(current, THRESHOLD, [].append)
    assert found.causes == ()
    assert np.flatnonzero(found.fit.noise.spread).tolist() == [TRIM]


@pytest.mark.parametrize("seed", range(3))
def test_numbers_that_none_needs_predict_a_run_that_was_left_out_worse(seed):
    """Each may be anything then, which makes what is measured less likely."""
    problem = Sensed(0.0, seed=seed)
    none = fit(problem, noise=Spreading(spread=(0.0, 0.0, 0.0)), refit_noise=False)
    with_numbers, without = explained(problem), Explanation((), none)
    assert (left_out_scores(without) > left_out_scores(with_numbers)).all()


def test_an_explanation_without_numbers_stays_as_it_is():
    problem = Sensed(0.8)
    own = fit(problem, noise=Spreading(spread=(0.0, 0.0, 0.0)), refit_noise=False)
    current = Explanation((), own)
    assert with_common_errors(current, THRESHOLD, [].append) is current


def test_no_more_causes_than_an_explanation_may_have():
    current = explained(Sensed(0.8))
    full = Explanation(tuple(f"cause {i}" for i in range(8)), current.fit)
    assert MOUNTING not in with_common_errors(full, THRESHOLD, [].append).causes
