"""An effect that takes the place of numbers of all runs does in them what these did."""

import numpy as np
import pytest

from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import COMMON
from fish_env.inference.in_common import begun
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, Setup, simulate

SIZES = np.array([0.5, 0.3, 0.4])
"""Of the numbers that an effect does, in usual spreads."""
SLOW = 0.002
"""By how much, where one parameter moves all of them."""


@pytest.fixture(scope="module")
def problem():
    return SeriesProblem(simulate(Setup(runs=2)), paths=PATHS)


@pytest.mark.parametrize("common", COMMON, ids=[one.effect for one in COMMON])
def test_an_effect_shows_what_numbers_of_all_runs_show(problem, common):
    nominal, noise = Point(np.zeros(len(PATHS)), {}), problem.default_noise()
    names = [variation.name for variation in problem.variations]
    at = [names.index(name) for name in common.numbers]
    numbers = np.zeros_like(problem.variation)
    sizes = [s * problem.variations[k].usual for s, k in zip(SIZES, at, strict=False)]
    numbers[:, at] = SLOW * np.array(common.rates) if common.rates else sizes
    numbered = problem.with_variation(numbers, nominal, noise)
    same, values = begun(numbered, common)
    assert same == at
    alone = problem.with_variation(np.zeros_like(numbers), nominal, noise)

    def left(of, point):
        return np.concatenate([run.residuals for run in of.filtered(point, noise)])

    nothing, by_numbers = left(alone, nominal), left(numbered, nominal)
    by_effect = left(alone, Point(nominal.z, values))
    change = np.linalg.norm(by_numbers - nothing)
    assert change > 0.0
    assert np.linalg.norm(by_effect - by_numbers) < 0.1 * change


def test_no_effect_bends_light_the_other_way(problem):
    (refraction,) = (one for one in COMMON if one.effect == "refraction")
    assert refraction.values([-0.1]) is None
