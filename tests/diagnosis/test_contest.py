"""Contests after the first: what chance calls for is over as soon as nothing gains."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.inference import search
from fish_env.inference.effort import FULL, QUICK
from fish_env.inference.explanation import Explanation
from fish_env.inference.policy import POLICY
from fish_env.inference.search import refits

PRESENT, NOTHING_MORE = 100.0, 90.0
"""Objective of the present explanation on the runs of a sketch, and of a sketch of it alone."""


class Named(str):
    """A cause by its name."""

    @property
    def cause(self):
        return SimpleNamespace(name=str(self))


def fake(name, score):
    return SimpleNamespace(
        name=name, score=score, objective=score, effects=("a",), released=(), noise=name,
        point=None, problem="runs",
    )  # fmt: skip


@pytest.fixture
def contest(monkeypatch):
    """Holds a contest of causes by the objectives of their sketches and the scores of their fits.

    Returns what it finds and which fits it made: (name, noise) with the noise held.
    """

    def run(
        sketches, scores, causes=("first",), at_limit=(), unseen=(), wandering=(), effort=FULL,
        base=PRESENT,
    ):  # fmt: skip
        fits = {name: fake(name, score) for name, score in scores.items()}
        done = SimpleNamespace(at_noise=[], in_full=[], noise_too=[], enough={})

        class CoarseFitter:
            def __init__(self, fit):
                self.fit, self.base = fit, base

            def coarse_fit(self, effects, released, begin):
                return SimpleNamespace(objective=NOTHING_MORE)

        def sketched(fitter, base, signal, begin, enough=np.inf):
            done.enough[str(signal)] = enough
            found = SimpleNamespace(name=str(signal), objective=sketches[signal], point=None)
            return [(signal, found)]

        def at_noise(problem, at, noise, *spent):
            done.at_noise.append((at.name, noise))
            return fits.get(at.name)

        def in_full(problem, at, noise):
            done.in_full.append(at.name)
            return fits[at.name]

        def noise_too(problem, own):
            done.noise_too.append(own.name)
            return own

        for name, value in {
            "CoarseFitter": CoarseFitter, "_coarse_fits": sketched, "starts": lambda *a: [],
            "disturbance_at_limit": lambda fit: at_limit,
            "_at_noise": at_noise, "in_full": in_full, "_noise_too": noise_too,
        }.items():  # fmt: skip
            monkeypatch.setattr(search, name, value)
        monkeypatch.setattr(Explanation, "score", property(lambda self: self.fit.score))
        present = Explanation(causes, fake("present", 0.0))
        seen = [Named(name) for name in sketches if name not in (*unseen, *wandering)]
        hidden, lost = ([Named(name) for name in names] for names in (unseen, wandering))
        loose = (fake("loose", 0.0), lost)
        found = refits(present, seen, lambda step: None, loose, effort, unseen=hidden)
        return (*found, done)

    return run


def test_it_is_over_where_nothing_gains_under_the_present_noise(contest):
    tried, base, done = contest({"b": 80.0, "c": 85.0}, {"b": 1.0, "c": 2.0})
    assert (tried, base) == ([], None)
    assert [noise for _, noise in done.at_noise] == ["present", "present"]
    assert not done.noise_too
    assert not done.in_full


def test_what_gains_leaves_its_own_noise_and_the_others_are_fitted_under_that(contest):
    tried, _, done = contest({"b": 80.0, "c": 85.0}, {"b": -3.0, "c": -9.0, "present": 0.0})
    assert [e.causes for e in tried] == [("first", "c"), ("first", "b")]
    assert done.noise_too == ["c"]
    assert done.at_noise[2:] == [("b", "c"), ("present", "c")]


@pytest.mark.parametrize(("causes", "at_limit"), [((), ()), (("first",), ("a disturbing force",))])
def test_where_the_present_noise_says_little_the_likeliest_brings_its_own(
    contest, causes, at_limit
):
    tried, _, done = contest({"b": 80.0, "c": 85.0}, {"b": 1.0, "c": 2.0}, causes, at_limit)
    assert len(tried) == 2
    assert done.in_full == ["b"]
    assert done.at_noise[0] == ("c", "b")


def test_what_the_screen_has_not_seen_is_fitted_only_if_its_sketch_gains(contest):
    """A sketch of what is there already gains as well: two runs are easier to please than six."""
    slight, plain = NOTHING_MORE - 1.0, NOTHING_MORE - 5.0
    scores = dict.fromkeys(("b", "c", "d"), 1.0)
    given = {"b": NOTHING_MORE + 5.0, "c": slight, "d": plain}
    *_, done = contest(given, scores, unseen=("c", "d"))
    assert sorted(name for name, _ in done.at_noise) == ["b", "d"]


def test_later_sketches_end_where_they_cannot_get_among_the_finalists(contest):
    scores = dict.fromkeys(("b", "c", "d"), 1.0)
    given = {"b": 8000.0, "c": 6000.0, "d": 7000.0}
    *_, done = contest(given, scores, (), unseen=("d",), base=10_000.0)
    assert done.enough == {
        "b": np.inf,
        "c": np.inf,
        "d": 6000.0 + POLICY.coarse_fit_behind * 4000.0,
    }
    assert "d" in dict(done.at_noise)
    *_, done = contest(given, scores, (), unseen=("d",), base=6500.0)
    assert done.enough["d"] == 6000.0 + max(
        POLICY.coarse_fit_leeway, POLICY.coarse_fit_behind * 500.0
    )
    assert "d" not in dict(done.at_noise)


def test_where_one_is_fitted_later_sketches_have_to_lead(contest):
    given = {"b": 8000.0, "c": 6000.0, "d": 7000.0}
    *_, done = contest(given, {"c": 1.0}, (), unseen=("d",), effort=QUICK, base=10_000.0)
    assert done.enough["d"] == 6000.0
    assert done.in_full == ["c"]


def test_what_was_begun_with_a_wandering_phase_has_to_get_among_the_finalists_too(contest):
    given = {"b": 6000.0, "w": 6500.0, "x": 9000.0}
    scores = dict.fromkeys(given, 1.0)
    *_, done = contest(given, scores, (), wandering=("w", "x"), base=10_000.0)
    assert done.enough["w"] == done.enough["x"] == 6000.0 + POLICY.coarse_fit_behind * 4000.0
    assert "w" in dict(done.at_noise)
    assert "x" not in dict(done.at_noise)


def test_nothing_is_tried_where_nothing_is_chosen():
    assert refits(Explanation((), None), [], lambda step: None) == ([], None)
