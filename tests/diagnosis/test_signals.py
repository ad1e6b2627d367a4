"""What the filter expects of an effect is what another implementation of the physics makes of it.

Two data sets share all of their noise; one has the effect. The difference of their whitened
residuals should be the one that the filter predicts for the effect.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.identification.series import SeriesProblem
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.params import load_fish
from tests.hidden.designs import swim_design
from tests.hidden.plans import PLANS
from tests.hidden.sizes import INVISIBLE, SIZES, draw_effect

PLAN = replace(PLANS["rich"], runs=2, duration=12.0)
EFFECTS = sorted(set(SIZES) - set(INVISIBLE))
SMALL = 0.1


def values_of(name):
    return draw_effect(name, SMALL, np.random.default_rng(len(name)))


@pytest.fixture(scope="module")
def swum(tmp_path_factory):
    """Residuals of the model without effects on measurements with some."""

    @cache
    def problem(name):
        folder = tmp_path_factory.mktemp("runs") / "data"
        truth = swim_design(0, 0, folder, {name: values_of(name)} if name else {}, plan=PLAN)
        nominal = load_fish(truth.fish)
        known = {path: v for path, v in truth.coefficients.items() if nominal.prior_sd(path) > 0.0}
        return SeriesProblem(load_dataset(folder), nominal.replace(known))

    return problem


@pytest.fixture(scope="module")
def still(swum):
    problem = swum("")
    noise = problem.default_noise()
    return problem, noise, problem.filtered(problem.start, noise)


def residuals(still, problem, effect="", values=None):
    _, noise, filtered = still
    lanes = {EffectParameterId(effect, k): np.array([v]) for k, v in (values or {}).items()}
    return problem.innovations(np.zeros((len(problem.baseline), 1)), lanes, noise, filtered)[0]


def signals(still, swum, hidden, modelled):
    """The signal that is there, and the one that is expected."""
    problem = still[0]
    before = residuals(still, problem)
    there = residuals(still, swum(hidden)) - before
    expected = before - residuals(still, problem, modelled, values_of(modelled))
    return there, expected


def cosine(a, b):
    return a @ b / np.sqrt((a @ a) * (b @ b))


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_the_expected_signal_is_there(still, swum, name):
    there, expected = signals(still, swum, name, name)
    assert cosine(there, expected) > 0.95
    assert 0.8 < np.sqrt((expected @ expected) / (there @ there)) < 1.25


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "modelled"), [("servo_lag", "tail_gain"), ("current", "tether")]
)
def test_the_signal_of_another_effect_is_not(still, swum, hidden, modelled):
    there, expected = signals(still, swum, hidden, modelled)
    assert abs(cosine(there, expected)) < 0.9
