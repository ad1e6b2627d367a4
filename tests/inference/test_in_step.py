"""Rates beside numbers of runs: swaps begin in step, and what the numbers explain is no cause."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.run_variation import RunVariation
from fish_env.inference.explanation import Explanation
from fish_env.inference.lookalikes import asked_of_rates, decided
from fish_env.inference.probes import causes_of
from fish_env.inference.problem import Point
from fish_env.inference.screening import screen
from fish_env.inference.substitution import without, without_in_step
from fish_env.inference.vehicle import Drive
from tests.inference.stated import Evaluated, Numbered, White, effect, size_of

RUNS, TIMES = 4, np.linspace(0.0, 1.0, 200)
BEAT, CLOCK, DRAG = "beat", "clock", "drag"
ORDINARY, CYCLES = 0.1, 30.0
BEATS = ORDINARY * np.array([0.9, 1.2, 0.8, 1.1])
"""Rates of runs: their mean is two standard errors of ordinary ones."""


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (ORDINARY,)


class Beating(Numbered):
    """Runs that each swing at a rate of their own, which a beat or a clock changes in all of them.

    Args:
        clock: what a clock adds to all rates; one that is off shows in another channel too.
        reading: how much of it shows there.
        beats: (RUNS,) rates of the runs.
    """

    def __init__(self, clock=0.0, reading=0.0, beats=BEATS):
        rng = np.random.default_rng(2)
        self.own, self.reading = beats[:, None].copy(), reading
        self.drag = rng.standard_normal(len(TIMES))
        truth = {size_of(BEAT): 0.0, size_of(CLOCK): clock, size_of(DRAG): 0.5}
        self.data = np.zeros((RUNS, 2 * len(TIMES)))
        self.data = -0.1 * self.swung(self.own, truth)
        self.data += 0.1 * rng.standard_normal(self.data.shape)
        self.variations = (RunVariation("beat", "1", ORDINARY, beside=size_of(BEAT)),)
        alike = {"drifts_in_phase": True}
        super().__init__((
            effect(BEAT, confusable_with=(CLOCK,), **alike),
            effect(CLOCK, confusable_with=(BEAT,), **alike),
            effect(DRAG),
        ))  # fmt: skip
        self.out_of_step, self.drive = (BEAT, CLOCK), Drive(uneven=True)
        self.begun = []

    def default_noise(self):
        return Spreading()

    def left(self, z, effects):
        return self.swung(self.own, effects)

    def swung(self, own, effects):
        rate = own + effects[size_of(BEAT)] + effects[size_of(CLOCK)]
        swing = np.sin(CYCLES * (1.0 + rate) * TIMES) + effects[size_of(DRAG)] * self.drag
        reading = self.reading * effects[size_of(CLOCK)] * np.ones((len(own), len(TIMES)))
        return 10.0 * (self.data + np.hstack([swing, reading]))

    def variation_slopes(self, point, noise, filtered, steps):
        effects = {**self.neutral(self.known), **point.effects}
        moved = self.swung(self.own + 1e-4, effects) - self.swung(self.own, effects)
        return moved[self.which].reshape(-1, 1) / 1e-4

    def filtered(self, point, noise, near=()):
        rows = self._rows(point.z, point.effects, noise)
        self.begun.append((dict(point.effects), float(np.mean(rows**2))))
        return [Evaluated(float(-0.5 * row @ row), row) for row in rows]


def explained(stated, *causes, **begin):
    """A fit with some causes, from where they are, and what its screen shows of the others."""
    start = Point(np.zeros(1), {size_of(name): begin.get(name, 0.0) for name in causes})
    current = Explanation(causes, fit(stated, causes, start, refit_noise=False))
    shown = screen(current.fit, causes_of(stated), np.random.default_rng(0))
    stated.begun.clear()
    return current, shown


def test_a_beat_takes_the_place_of_a_clock_in_step():
    """The runs give up what it brings; else they would be a radian out of step."""
    stated = Beating(clock=0.1, reading=0.3)
    current, shown = explained(stated, CLOCK, DRAG, clock=0.1)
    current.fit.problem.drive = Drive({size_of(BEAT): 0.14}, uneven=True)
    best, alike = asked_of_rates(current, shown, [].append)
    effects, misfit = next(begun for begun in stated.begun if size_of(BEAT) in begun[0])
    assert effects[size_of(BEAT)] == 0.14
    assert misfit < 2.0
    assert (best.causes, alike) == ((CLOCK, DRAG), ())


@pytest.mark.parametrize("asked", [asked_of_rates, decided])
def test_a_rate_that_numbers_of_the_runs_explain_is_no_cause(asked):
    current, shown = explained(Beating(reading=3.0), CLOCK, DRAG)
    told = []
    best, _ = asked(current, shown, told.append)
    assert best.causes == (DRAG,)
    assert told == [f"fitting without {CLOCK}", f"fitting with {CLOCK} again"]


def test_a_single_cause_is_not_left_to_the_runs():
    current, shown = explained(Beating(reading=3.0), CLOCK)
    told = []
    asked_of_rates(current, shown, told.append)
    assert f"fitting without {CLOCK}" not in told


def test_a_cause_is_not_dropped_for_what_a_fit_gains_elsewhere():
    """The fit with it has not converged: without it the drag is estimated too."""
    stated = Beating(clock=0.008, reading=3.0)
    begin = Point(np.zeros(1), {size_of(CLOCK): 0.008, size_of(DRAG): 0.3})
    own = fit(stated, (CLOCK, DRAG), begin, refit_noise=False, iterations=0)
    current = Explanation((CLOCK, DRAG), own)
    shown = screen(own, causes_of(stated), np.random.default_rng(0))
    told = []
    best, _ = asked_of_rates(current, shown, told.append)
    assert told[:2] == [f"fitting without {CLOCK}", f"fitting with {CLOCK} again"]
    assert best.causes == (CLOCK, DRAG)
    assert best.fit.point.effects[size_of(DRAG)] == pytest.approx(0.5, abs=0.05)


def test_a_cause_is_not_left_to_runs_that_would_differ_by_more_than_ordinary_ones():
    """Of two and a half spreads in each of four runs the chance is 1e-4: it is one beat of all."""
    current, shown = explained(Beating(reading=0.3, beats=np.full(RUNS, 0.25)), CLOCK, DRAG)
    best, _ = asked_of_rates(current, shown, [].append)
    assert best.causes == (BEAT, DRAG)


def shared_beat():
    """What all runs have in common of their rates in a cause, and the rest in their numbers."""
    stated = Beating(beats=BEATS - BEATS.mean())
    stated.data = Beating().data
    current, _ = explained(stated, BEAT, DRAG, beat=BEATS.mean())
    assert current.fit.point.effects[size_of(BEAT)] == pytest.approx(BEATS.mean(), abs=0.03)
    return stated, current


@pytest.mark.parametrize(
    "dropping",
    [without_in_step, lambda current, dropped: current.varied(dropped=dropped)],
    ids=["rejected", "insignificant"],
)
def test_runs_stay_in_step_when_a_rate_is_dropped(dropping):
    stated, current = shared_beat()
    smaller = dropping(current, (BEAT,))
    _, misfit = stated.begun[0]
    assert misfit < 2.0
    assert smaller.causes == (DRAG,)
    assert smaller.fit.problem.own[:, 0] == pytest.approx(BEATS, abs=0.03)


def test_whether_a_rate_is_needed_is_asked_out_of_step():
    """Numbers of its runs would make up for any rate: it has to be worth its cost."""
    stated, current = shared_beat()
    without(current, (BEAT,))
    _, misfit = stated.begun[0]
    assert misfit > 10.0
