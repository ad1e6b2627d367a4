"""Simulations that diverge end an attempt, not the diagnosis."""

import numpy as np
import pytest

from fish_env.inference import elimination
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.hypotheses import EffectParameterId, effects_of
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import screen
from fish_env.inference.search import refits
from fish_env.inference.substitution import without
from tests.inference.stated import SIZE, Stated, White, apart, cause_of, effect, signal_of

SIZES = {"a": 60.0, "b": 50.0, "c": 40.0}
"""Of causes, by which they explain what is there; sketches of each are as good in that order."""


def diverge():
    raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")


def test_only_divergence_ends_a_fit_quietly():
    assert reached(diverge) is None
    with pytest.raises(ZeroDivisionError):
        reached(lambda: 1 // 0)


@pytest.mark.parametrize("size", [1.0, 5.0])  # it may do nothing, or is needed
def test_a_cause_without_which_the_simulation_diverges_is_not_dropped(size):
    def alone(effects, noise):
        return effects_of(effects) != {"a", "b"}

    problem = Stated(apart({"a": [size], "b": [size]}), [effect("a"), effect("b")], diverging=alone)
    both = Explanation(("a", "b"), fit(problem, ("a", "b"), refit_noise=False))
    assert without(both, ("a",)) is None
    assert elimination.backward_elimination(both) == (both, ())


def contest(diverging, shown="abc", steady=0.0):
    """Three causes, some of which diverge in runs that no sketch uses.

    Without any the simulation diverges where the noise is below what is steady.
    """
    wanted = {name: np.full(7, size) for name, size in SIZES.items()}
    for name in diverging:
        wanted[name][3] = np.nan
    known = {name: effect(name) for name in SIZES}
    problem = Stated(
        apart(wanted), known.values(), learns=True,
        diverging=lambda effects, noise: not effects and noise.sd < steady,
    )  # fmt: skip
    present = Explanation((), fit(problem, noise=White(50.0), rounds=1))
    signals = {name: signal_of(cause_of(known[name]), SIZES[name] ** 2) for name in SIZES}
    like = {shown[0]: [signals[name] for name in SIZES if name not in shown]}.__getitem__
    chosen = [signals[name] for name in shown]
    return present, *refits(present, chosen, lambda step: None, like=like)


@pytest.mark.parametrize("steady", [0.0, 35.0])
def test_the_best_of_those_that_do_not_diverge_leads(steady):
    present, tried, base = contest("ac", steady=steady)
    assert [e.causes for e in tried] == [("b",)]
    assert tried[0].fit.noise.sd < 35.0 < present.fit.noise.sd
    # A baseline that diverges as well keeps the disturbance that suits it.
    assert base.fit.noise == (present if steady else tried[0]).fit.noise


def test_no_cause_is_found_where_all_diverge():
    assert contest("abc")[1:] == ([], None)


def test_what_looks_like_the_best_is_tried_too():
    """A strong effect is screened far from where it is, and one that looks like it may hide it."""
    _, tried, _ = contest("", shown="bc")
    assert [e.causes for e in tried] == [("a",), ("b",), ("c",)]


@pytest.mark.parametrize("huge", [1e200, np.inf])
def test_an_effect_that_moves_beyond_all_measure_shows_nothing(huge):
    """A simulation may diverge and stay finite: its change must not reach the linear model."""

    def residuals(z, effects):
        size = effects[EffectParameterId("a", SIZE)]
        lost = 0.0 if effects[EffectParameterId("b", SIZE)] == 0.0 else huge
        return np.array([[size - 9.0 + lost, lost, z.sum()]] * 3)

    problem = Stated(residuals, [effect("a", 10.0), effect("b", 10.0)])
    own = fit(problem, refit_noise=False)
    with np.errstate(all="raise"):
        shown = screen(own, causes_of(problem), np.random.default_rng(0))
    assert [s.cause.id for s in shown.best() if s.cause.is_effect] == ["a"]
