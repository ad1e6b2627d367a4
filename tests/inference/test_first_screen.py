"""What comes first, a cause or what the runs differ in: the one that explains more."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.estimate.again import quietened
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.run_variation import RunVariation
from fish_env.inference.explanation import Explanation
from fish_env.inference.first_screen import first_screen
from fish_env.inference.probes import causes_of
from tests.inference.stated import Numbered, Stated, White, effect, size_of

RUNS, SAMPLES = 6, 100
PUSH = "push"


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (0.0,)


class Differing(Numbered):
    """Runs of which each has a trim of its own, and an effect that does something else in all.

    Args:
        push: size of the effect.
        trim: standard deviation of the trims.
    """

    def __init__(self, push, trim):
        rng = np.random.default_rng(1)
        self.pushed, self.along = rng.standard_normal((2, RUNS, SAMPLES))
        trims = trim * rng.standard_normal((RUNS, 1))
        self.seen = push * self.pushed + trims * self.along + rng.standard_normal((RUNS, SAMPLES))
        self.variations = (RunVariation("trim", "m", 1.0),)
        self.own = np.zeros((RUNS, 1))
        super().__init__([effect(PUSH)])

    def default_noise(self):
        return Spreading()

    def left(self, z, effects):
        return self.seen - effects[size_of(PUSH)] * self.pushed - self.own * self.along

    def variation_slopes(self, point, noise, filtered, steps):
        return -self.along[self.which].reshape(-1, 1)


@pytest.mark.parametrize(("push", "trim", "differs"), [(1.0, 0.5, False), (0.3, 2.0, True)])
def test_what_explains_more_comes_first(push, trim, differs):
    nothing = Explanation((), fit(Differing(push, trim), refit_noise=False))
    found, shown = first_screen(nothing, causes_of(nothing.fit.problem), np.random.default_rng(0))
    assert (found is not nothing) == differs
    assert bool(found.fit.noise.spread[0]) == differs
    assert shown.best()[0].cause.id == PUSH
    assert shown.best()[0].log_p < shown.threshold


class Sticky(Stated):
    """Residuals of a coefficient alone, and noise that stays as large as a fit begins with."""

    def __init__(self, sd, limit=5.0):
        rng = np.random.default_rng(0)
        x, seen = rng.standard_normal((2, 2, SAMPLES))
        super().__init__(lambda z, effects: sd * seen - z[0] * x, limit=limit)


@pytest.mark.parametrize(
    ("sd", "limit", "kept"),
    [(1.0, 5.0, False), (20.0, 5.0, True), (1.0, 50.0, True)],
    ids=["swamped", "noisy", "within its limit"],
)
def test_a_disturbance_that_stays_is_left_behind(sd, limit, kept):
    """Where a fit with little noise is likelier; not if noise is needed, or within its limit."""
    own = fit(Sticky(sd, limit), noise=White(20.0))
    found = quietened(own)
    assert (found is own) == kept
    assert found.noise.sd == (20.0 if kept else 1.0)
    assert found.objective <= own.objective
