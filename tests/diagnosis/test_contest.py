"""Contests after the first: what chance calls for is over as soon as nothing gains."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.effort import FULL, QUICK
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.search import refits
from tests.inference.stated import (
    SIZE,
    Log,
    Stated,
    White,
    apart,
    cause_of,
    effect,
    fit_of,
    signal_of,
)

SHORT, LOOSE = 1.5, 10.0
"""How far a sketch begins from its end at most, and relaxed noise under which it stays there."""


@dataclass
class Held:
    """A contest that was held."""

    tried: list
    base: Explanation | None
    problem: Stated
    noise: White
    reports: list

    @property
    def fitted(self):
        return [said.split()[1] for said in self.reports if said.startswith("fitting")]

    @property
    def noise_left_by(self):
        """The causes under which the noise was fitted in the contest."""
        return {name for names in self.problem.log.noise_fitted for name in names - {"first"}}

    def simulated(self, name):
        """How often residuals of the sketched runs were asked for with a cause."""
        return sum(name in names and runs == 2 for names, runs in self.problem.log.simulated)


def targets(sketch, full):
    """Sizes in seven runs by what they gain in the sketched runs, and in all by their mean.

    A sketch uses the first and the last run, and gains twice the square of their size; a fit gains
    seven times that of the mean.
    """
    near = np.sqrt(0.5 * sketch)
    rest = (np.sqrt(full / 7.0) * 7.0 - 2.0 * near) / 5.0
    return np.array([near, *[rest] * 5, near])


def contest(
    gains, causes=("first",), limit=np.inf, unseen=(), wandering=(), effort=FULL, learns=True
):
    """Holds a contest of causes by what they gain: in a sketch, and in all runs."""
    wanted = {name: targets(*both) for name, both in gains.items()}
    wanted["first"] = np.full(7, 30.0 if causes else 0.0)
    known = {name: effect(name) for name in wanted}
    problem = Stated(apart(wanted), known.values(), limit=limit)
    loose = fit(problem, causes, noise=White(LOOSE), refit_noise=False)
    present = Explanation(causes, fit(problem, causes, refit_noise=False))
    problem.learns, problem.log = learns, Log()
    begun = {name: wanted[name][0] - min(SHORT, 0.5 * wanted[name][0]) for name in gains}
    probes = (({SIZE: 1.0},),)
    named = {n: signal_of(cause_of(known[n], probes), size**2) for n, size in begun.items()}
    hidden, lost = ([named[name] for name in names] for names in (unseen, wandering))
    seen = [named[name] for name in gains if name not in (*unseen, *wandering)]
    said = []
    found = refits(present, seen, said.append, (loose, lost), effort, unseen=hidden)
    return Held(*found, problem, present.fit.noise, said)


def test_it_is_over_where_nothing_gains_under_the_present_noise():
    held = contest({"b": (20.0, 1.0), "c": (10.0, 0.5)})
    assert (held.tried, held.base) == ([], None)
    assert sorted(held.fitted) == ["b", "c"]
    assert not held.problem.log.noise_fitted


@pytest.mark.parametrize("sketches", [(90.0, 60.0), (60.0, 90.0)])
def test_what_gains_leaves_its_own_noise_and_the_others_are_fitted_under_that(sketches):
    held = contest({"b": (sketches[0], 80.0), "c": (sketches[1], 200.0)})
    assert [e.causes for e in held.tried] == [("first", "c"), ("first", "b")]
    assert held.noise_left_by == {"c"}
    assert {e.fit.noise for e in (*held.tried, held.base)} == {held.tried[0].fit.noise}
    assert held.tried[0].fit.noise != held.noise


@pytest.mark.parametrize(("causes", "limit"), [((), np.inf), (("first",), 0.5)])
def test_where_the_present_noise_says_little_the_likeliest_brings_its_own(causes, limit):
    held = contest({"b": (20.0, 1.0), "c": (10.0, 0.5)}, causes, limit)
    assert [e.causes[-1] for e in held.tried] == ["b", "c"]
    assert held.noise_left_by == {"b"}
    assert {e.fit.noise for e in (*held.tried, held.base)} == {held.tried[0].fit.noise}
    assert held.tried[0].fit.noise != held.noise


def test_what_the_screen_has_not_seen_is_fitted_only_if_its_sketch_gains():
    """A sketch of what is there already gains as well: two runs are easier to please than seven."""
    held = contest({"b": (0.01, 0.5), "c": (1.5, 0.5), "d": (30.0, 0.5)}, unseen=("c", "d"))
    assert sorted(held.fitted) == ["b", "d"]


FAR = {"b": (2000.0, 900.0), "c": (4000.0, 900.0), "d": (3100.0, 900.0)}
"""Finalists lack at most a quarter of what the leader gains: c and d are."""
NEAR = {"b": (60.0, 90.0), "c": (500.0, 90.0), "d": (300.0, 90.0)}
"""They lack at most an eighth of a thousand: only c is."""


def test_later_sketches_end_where_they_cannot_get_among_the_finalists():
    far, near = (contest(gains, (), unseen=("d",), learns=False) for gains in (FAR, NEAR))
    assert sorted(far.fitted) == ["c", "d"]
    assert near.fitted == ["c"]
    assert near.simulated("d") < near.simulated("b") == far.simulated("b")


def test_where_one_is_fitted_later_sketches_have_to_lead():
    held = contest(FAR, (), unseen=("d",), effort=QUICK, learns=False)
    assert held.fitted == ["c"]
    assert held.simulated("d") < held.simulated("b")


def test_what_was_begun_with_a_wandering_phase_has_to_get_among_the_finalists_too():
    gains = {"b": (4000.0, 900.0), "w": (3500.0, 900.0), "x": (1000.0, 900.0)}
    held = contest(gains, (), wandering=("w", "x"), learns=False)
    assert sorted(held.fitted) == ["b", "w"]
    assert held.simulated("x") < held.simulated("w")


def test_nothing_is_tried_where_nothing_is_chosen():
    nothing = Explanation((), fit_of(Stated(apart({"a": [1.0]}), [effect("a")])))
    assert refits(nothing, [], lambda step: None) == ([], None)
