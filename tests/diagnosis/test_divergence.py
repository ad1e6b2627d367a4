"""Simulations that diverge end an attempt, not the diagnosis."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.inference import elimination, search
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.search import refits, without


def diverge(*arguments, **options):
    raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")


def fake(name="fit"):
    problem = SimpleNamespace(baseline=(), known={})
    problem.subset = lambda count: problem
    return SimpleNamespace(
        problem=problem, effects=("a", "b"), released=(), noise=None, name=name, objective=0.0,
        point=SimpleNamespace(z=np.zeros(0), effects={"effects.a.x": 1.0, "effects.b.x": 1.0}),
    )  # fmt: skip


def test_only_divergence_ends_a_fit_quietly():
    assert reached(diverge) is None
    with pytest.raises(ZeroDivisionError):
        reached(lambda: 1 // 0)


def test_a_cause_without_which_the_simulation_diverges_is_not_dropped(monkeypatch):
    monkeypatch.setattr(search, "fit", diverge)
    monkeypatch.setattr(elimination, "may_not_act", lambda fit, name: False)
    monkeypatch.setattr(elimination, "surely_acts", lambda fit, name: False)
    both = Explanation(("a", "b"), fake())
    assert without(both, ("a",)) is None
    assert elimination.backward_elimination(both) is both


def contest(monkeypatch, results, shown="abc"):
    """Three sketches, best first, and what becomes of each when it is fitted in full."""
    sketches = [(name, SimpleNamespace(objective=i, name=name)) for i, name in enumerate("abc")]
    monkeypatch.setattr(search, "CoarseFitter", lambda base: SimpleNamespace(base=1000.0))
    monkeypatch.setattr(search, "starts", lambda *arguments: [])
    by_name = dict(sketches)
    monkeypatch.setattr(
        search, "_coarse_fits", lambda s, base, signal, *rest: [(signal, by_name[signal])]
    )
    monkeypatch.setattr(search, "in_full", lambda problem, s, noise: results[s.name])
    monkeypatch.setattr(
        search,
        "_at_noise",
        lambda problem, at, noise, *spent: results.get(getattr(at, "name", None)),
    )
    monkeypatch.setattr(search, "_best_first", lambda tried, leader: (tried, None))
    monkeypatch.setattr(
        search, "_finalists", lambda found, *rest: sorted(found, key=lambda f: f[1].objective)
    )
    named = [Signal(name) for name in shown]
    like = {shown[0]: [Signal(name) for name in "abc" if name not in shown]}.__getitem__
    return refits(Explanation((), fake("base")), named, lambda step: None, like=like)


class Signal(str):
    """A cause by its name."""

    @property
    def cause(self):
        return SimpleNamespace(name=str(self))


def test_the_best_of_those_that_do_not_diverge_leads(monkeypatch):
    tried, base = contest(monkeypatch, {"a": None, "b": fake("b"), "c": None})
    assert [e.causes for e in tried] == [("b",)]
    assert base.fit.name == "base"  # it diverged as well, and keeps the disturbance that suits it


def test_no_cause_is_found_where_all_diverge(monkeypatch):
    assert contest(monkeypatch, dict.fromkeys("abc")) == ([], None)


def test_what_looks_like_the_best_is_tried_too(monkeypatch):
    """A strong effect is screened far from where it is, and one that looks like it may hide it."""
    tried, _ = contest(monkeypatch, {"a": fake("a"), "b": fake("b"), "c": fake("c")}, shown="bc")
    assert [e.causes for e in tried] == [("a",), ("b",), ("c",)]
