"""A look-alike that was taken for an earlier cause gives way once the others are there."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.problem import Point
from fish_env.inference.substitution import substituted
from tests.inference.stated import Stated, cause_of, effect, signal_of, size_of

SOFT, DELAY, LAG, CURRENT = NAMES = ("soft_tail", "delay", "lag", "current")
KNOWN = {name: effect(name, lower=0.0 if name == LAG else -np.inf) for name in NAMES}
SHAPES = np.random.default_rng(3).standard_normal((3, 40))
"""What the first three would do if they were alike in nothing."""


def swimming(acting, size, of_lag=lambda size: size):
    """A few runs in which one of the effects acts beside a current; all but that look alike."""
    looks = {n: SHAPES.mean(axis=0) + 0.3 * own for n, own in zip(NAMES, SHAPES, strict=False)}
    looks[CURRENT] = np.cos(np.arange(40.0))
    truth = {acting: size, CURRENT: 8.0}

    def residuals(z, effects):
        sizes = {name: effects[size_of(name)] for name in NAMES}
        sizes[LAG] = of_lag(sizes[LAG])
        off = [(sizes[name] - truth.get(name, 0.0)) * looks[name] for name in NAMES]
        return np.tile(z[0] + sum(off), (3, 1))

    return Stated(residuals, KNOWN.values())


def pairs(*names):
    return [(SOFT, signal_of(cause_of(KNOWN[name]), 50.0)) for name in names]


@pytest.mark.parametrize(
    ("acting", "size", "fitted"),
    [(LAG, 8.0, 1), (LAG, 2.0, 1), (SOFT, 1.5, 1), (SOFT, 8.0, 0)],  # far behind: not fitted
)
def test_a_better_look_alike_takes_the_place(acting, size, fitted):
    own = fit(swimming(acting, size), (SOFT, CURRENT), refit_noise=False)
    now = Explanation((SOFT, CURRENT), own)
    best, *others = substituted(now, pairs(DELAY, LAG), 1, lambda step: None)
    assert best.causes == (acting, CURRENT)
    assert len(others) == fitted
    # Nothing of the effect that was taken out is left.
    assert best.fit.point.effects.keys() == {size_of(acting), size_of(CURRENT)}


def astray(size):
    """From a large size, which explains more than a small one, the slope leads past the truth."""
    return 20.0 * float(np.interp(size, *zip(*TURNS, strict=True)))


TURNS = [(-9.0, 0.0), (0.0, 0.0), (0.09, -0.5), (0.2, 1.0), (0.4, 0.02), (0.8, -0.12), (9.0, -0.12)]
"""Of what a lag does, by its size; its probes are 0.1 and 0.6."""


def test_one_that_ends_switched_off_is_tried_from_each_size():
    own = fit(swimming(LAG, 20.0, astray), (SOFT, CURRENT), refit_noise=False)
    now = Explanation((SOFT, CURRENT), own)
    both = [Point(own.point.z, {size_of(CURRENT): 8.0, size_of(LAG): size}) for size in (0.1, 0.6)]
    alone = CoarseFitter(own).coarse_fit((LAG, CURRENT), (), both)
    assert alone.point.effects[size_of(LAG)] == 0.0
    best = substituted(now, pairs(LAG), 1, lambda step: None)[0]
    assert best.causes == (LAG, CURRENT)
    assert best.fit.point.effects[size_of(LAG)] == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(("limit", "others"), [(SOFT, 0), (CURRENT, 0), (None, 1)])
def test_one_that_acts_as_a_cause_does_takes_no_place(limit, others):
    """A limit of torque that is never reached limits the speed, which is a cause already.

    Nor does it take that of another cause: beside a limit of the speed either can be done without.
    """
    parts = {limit: {"size": 1.0}} if limit else {}
    both = replace(KNOWN[LAG], parts=lambda values: parts)
    problem = swimming(SOFT, 1.5)
    problem.known = {**problem.known, LAG: both}
    own = fit(problem, (SOFT, CURRENT), refit_noise=False)
    found = substituted(Explanation((SOFT, CURRENT), own), pairs(LAG), 1, lambda step: None)
    assert len(found) == 1 + others
