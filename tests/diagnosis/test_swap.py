"""A look-alike that was taken for an earlier cause gives way once the others are there."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.inference import search
from fish_env.inference.explanation import Explanation
from fish_env.inference.probes import Cause, probes_of
from fish_env.inference.search import substituted

KNOWN = catalogue()


def fit_of(effects, objective):
    problem = SimpleNamespace(known=KNOWN, samples=1000, baseline=())
    values = {f"effects.{e}.{n}": v for e in effects for n, v in KNOWN[e].neutral.items()}
    return SimpleNamespace(
        problem=problem, effects=effects, released=(), objective=objective, noise=None,
        names=tuple(values), point=SimpleNamespace(z=np.zeros(1), effects=values),
        linearised=SimpleNamespace(slopes=np.eye(50, len(values))),
    )  # fmt: skip


OBJECTIVES = {("servo_lag", "current"): -50.0, ("servo_delay", "current"): 20.0}


class Judge:
    """Sketches whose objective is told by their effects."""

    def __init__(self, fit):
        self.fit = fit

    @property
    def base(self):
        return self.fit.objective

    def coarse_fit(self, effects, released, begin):
        names = {p.split(".")[1] for point in begin for p in point.effects}
        assert names == set(effects)  # nothing of the effect that was taken out
        return SimpleNamespace(effects=effects, objective=OBJECTIVES[effects], point=begin[0])


class Passing(Judge):
    """Sketches that run past the effect, to where it is off, unless they begin at a small size."""

    def coarse_fit(self, effects, released, begin):
        last = begin[-1].effects
        near = len(begin) == 1 and min(last.values()) < 0.02
        nothing = {p: v if "current" in p else 0.0 for p, v in last.items()}
        point = begin[0] if near else SimpleNamespace(effects=nothing)
        objective = OBJECTIVES[effects] if near else 500.0
        return SimpleNamespace(effects=effects, objective=objective, point=point)


def signals(*names):
    return [SimpleNamespace(cause=Cause(n, probes_of(KNOWN[n])), probe=0) for n in names]


def fitted(problem, coarse, noise, iterations):
    return fit_of(coarse.effects, coarse.objective)


def pairs(current, *names):
    return [(current.causes[0], signal) for signal in signals(*names)]


@pytest.mark.parametrize(
    ("reached", "kept"), [(0.0, ("servo_lag", "current")), (-90.0, ("tail_flexibility", "current"))]
)
def test_a_better_look_alike_takes_the_place(monkeypatch, reached, kept):
    monkeypatch.setattr(search, "CoarseFitter", Judge)
    monkeypatch.setattr(search, "_at_noise", fitted)
    effects = ("tail_flexibility", "current")
    now = Explanation(effects, fit_of(effects, reached))
    others = pairs(now, "servo_delay", "servo_lag")
    assert substituted(now, others, 1, lambda step: None)[0].causes == kept


def test_one_that_ends_switched_off_is_tried_from_each_size(monkeypatch):
    monkeypatch.setattr(search, "CoarseFitter", Passing)
    monkeypatch.setattr(search, "_at_noise", fitted)
    effects = ("tail_flexibility", "current")
    now = Explanation(effects, fit_of(effects, 0.0))
    found = substituted(now, pairs(now, "servo_lag"), 1, lambda step: None)
    assert found[0].causes == ("servo_lag", "current")
