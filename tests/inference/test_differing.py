"""What runs share and also differ in: no better known than a mean over the runs."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification.variation import EVERY
from fish_env.inference.estimate.again import own_likelihoods
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.profile import profiled
from fish_env.inference.estimate.run_variation import RunVariation
from fish_env.inference.problem import Point
from tests.inference.stated import Numbered, White, effect, size_of

RUNS, SAMPLES = 6, 100
DRIFT = size_of("drift")


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (1.0,)


class Drifting(Numbered):
    """Runs in water that drifts, in each a little differently, seen very accurately.

    A run's own drift does the same as the drift of all, but its slopes were worked out in another
    way, and are a little off.

    Args:
        seed: of the runs' drifts and of the noise.
        spread: of the drifts.
        declared: whether the problem says what its runs differ in beside what they share.
    """

    MEAN = 4.0

    def __init__(self, seed, spread=1.0, declared=True):
        rng = np.random.default_rng(seed)
        self.along = 100.0 * rng.standard_normal((RUNS, SAMPLES))
        self.nearly = self.along + 3.0 * rng.standard_normal((RUNS, SAMPLES))
        drifts = self.MEAN + spread * rng.standard_normal((RUNS, 1))
        self.seen = drifts * self.along + rng.standard_normal((RUNS, SAMPLES))
        beside = DRIFT if declared else None
        self.variations = (RunVariation("own_drift", "1", 1.0, beside=beside),)
        self.own = np.zeros((RUNS, 1))
        super().__init__([effect("drift", 10.0)])

    def left(self, z, effects):
        return self.seen - (effects[DRIFT] + self.own) * self.along

    def variation_slopes(self, point, noise, filtered, steps):
        return -self.nearly[self.which].reshape(-1, 1)


def coverage(spread, declared):
    """Share of 95 % intervals that hold the drift that runs scatter about."""
    held = []
    for seed in range(60):
        problem = Drifting(seed, spread, declared)
        own = fit(problem, ["drift"], noise=Spreading(), refit_noise=False)
        low, high = own.interval(DRIFT)
        held.append(low < problem.MEAN < high)
    return np.mean(held)


@pytest.mark.parametrize("spread", [1.0, 3.0])
def test_intervals_hold_what_runs_scatter_about(spread):
    """Also where they scatter by more than the fit was told."""
    assert coverage(spread, declared=True) >= 0.9
    assert coverage(spread, declared=False) < 0.6


def test_the_shared_number_is_the_mean_over_runs():
    """Steps to it are as long as if the two were told apart by nothing; else it stays far off."""

    def off(seed, declared):
        problem = Drifting(seed, 3.0, declared)
        own = fit(problem, ["drift"], noise=Spreading(), refit_noise=False)
        each = (problem.seen * problem.along).sum(1) / (problem.along**2).sum(1)
        return abs(own.point.effects[DRIFT] - each.mean())

    assert max(off(seed, declared=True) for seed in range(6)) < 1e-3
    assert max(off(seed, declared=False) for seed in range(6)) > 0.1


@pytest.mark.parametrize("declared", [True, False])
def test_numbers_that_undo_an_effect_are_seen_to_be_unneeded(declared):
    """Where they are not known to do the same, the error of their slopes seems to need them."""
    problem = Drifting(0, spread=0.0, declared=declared)
    problem.own[:] = -0.5
    begin = Point(np.zeros(1), {DRIFT: problem.MEAN + 0.5})
    own = fit(problem, ["drift"], begin, Spreading(), refit_noise=False, iterations=0)
    spread = own_likelihoods(own)(np.zeros((1, 0)))
    assert (spread(np.zeros(1)) < spread(np.ones(1))) is declared


def test_what_runs_differ_in_beside_an_effect_names_a_parameter_of_it():
    named = [v.beside for v in EVERY if v.beside is not None]
    assert len(named) == len(set(named)) == 24
    for id in named:
        assert id.name in {p.name for p in catalogue()[id.effect].parameters}


def test_a_profile_begins_with_the_gain_that_its_fits_count():
    """A gain that a run did not reach counts in none: else each would look better than the fit."""
    problem = Drifting(0)
    own = fit(problem, ["drift"], noise=Spreading(), refit_noise=False)
    uncounted = replace(own, objective=own.objective + 50.0)
    known = profiled(uncounted)
    assert known.point is own.point
    assert known.interval(DRIFT) == profiled(own).interval(DRIFT)
