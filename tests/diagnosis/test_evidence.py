"""The evidence for an explanation, where it can be computed without approximation."""

import numpy as np
import pytest

from fish_env.inference.elimination import last_departs
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.left_out import left_out_scores
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.ranking import ranking_of
from fish_env.inference.rivals import agreed, alike
from tests.diagnosis.linear import COEFFICIENTS, PATHS, LinearProblem
from tests.inference.stated import Evaluated, Stated, effect, fit_of, size_of

LINEAR = LinearProblem(signals=2)
RANGE = 40.0
"""Of the effect's plausible values: its prior spread is that over the square root of twelve."""
RUNS = 6
LEVEL = float(np.log(0.01))
RUN_OF = np.repeat(np.arange(RUNS), LINEAR.size // RUNS)
KNOWN = {name: effect(name, 0.5 * RANGE) for name in ("first", "second")}
COLUMNS = dict(zip(KNOWN, LINEAR.columns, strict=True))
PROBLEM = Stated(lambda z, effects: (LINEAR.slopes @ z)[None], KNOWN.values(), PATHS)
"""All residuals as those of one run, where runs are not asked whether they agree."""
OF_RUNS = Stated(lambda z, effects: (LINEAR.slopes @ z).reshape(RUNS, -1), KNOWN.values(), PATHS)


def explanation(data, effects=(), released=(), problem=PROBLEM, short=0.0):
    """The best fit of coefficients under their priors and of effects without any.

    Or one that ended short of it, by so much in each coefficient.
    """
    slopes = np.hstack([LINEAR.slopes, *(COLUMNS[name] for name in effects)])
    prior = np.array([0.0 if path in released else 1.0 for path in PATHS] + [0.0] * len(effects))
    best = -np.linalg.solve(slopes.T @ slopes + np.diag(prior), slopes.T @ data)
    best[:COEFFICIENTS] -= short
    residuals = data + slopes @ best
    times = np.repeat(3.0 * np.arange(60) + 1.0, 20)
    lines = Linearised(residuals, slopes, np.repeat(np.arange(RUNS), 20 * 60 // RUNS), times)
    sizes = dict(zip(map(size_of, effects), best[COEFFICIENTS:].tolist(), strict=True))
    lifted = tuple(map(Coefficient, released))
    fit = fit_of(
        problem, effects, lifted, Point(best[:COEFFICIENTS], sizes), linearised=lines,
        objective=residuals @ residuals + prior @ best**2,
        filtered=[Evaluated(-0.5 * r @ r, r) for r in np.split(residuals, RUNS)],
    )  # fmt: skip
    return Explanation((*effects, *lifted), fit)


def exact(data, effects=(), released=()):
    """-2 log of the density of the data, everything unknown integrated out."""
    widths = np.array([POLICY.prior_reach_sd if path in released else 1.0 for path in PATHS])
    parts = [LINEAR.slopes * widths]
    parts += [COLUMNS[name] * RANGE / np.sqrt(12.0) for name in effects]
    factor = np.hstack(parts)
    spread = np.eye(len(data)) + factor @ factor.T
    return data @ np.linalg.solve(spread, data) + np.linalg.slogdet(spread)[1]


def foretold(data, run, effects=()):
    """Log density of a run given the others, but for a constant: that of all less that of them."""
    mine = run == RUN_OF
    parts = [LINEAR.slopes, *(COLUMNS[name] * RANGE / np.sqrt(12.0) for name in effects)]
    factor = np.hstack(parts)

    def log_density(rows):
        spread = np.eye(rows.sum()) + factor[rows] @ factor[rows].T
        squares = data[rows] @ np.linalg.solve(spread, data[rows])
        return -0.5 * (squares + np.linalg.slogdet(spread)[1])

    return log_density(np.ones_like(mine)) - log_density(~mine)


def data(seed=0, strength=0.0, memory=0.0):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(LINEAR.size)
    for i in range(1, LINEAR.size) if memory else ():
        noise[i] = memory * noise[i - 1] + np.sqrt(1 - memory**2) * noise[i]
    return noise - LINEAR.slopes @ rng.standard_normal(COEFFICIENTS) - strength * COLUMNS["first"][
        :, 0
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("effects", "released"), [(("first",), ()), (("first", "second"), ()), ((), ("c1",))]
)
def test_differences_of_scores_are_those_of_the_exact_evidence(effects, released):
    y = data(strength=1.5)
    found = explanation(y, effects, released).score - explanation(y).score
    expected = exact(y, effects, released) - exact(y)
    assert found == pytest.approx(expected, abs=0.3)
    naked = explanation(y, effects, released).fit.objective - explanation(y).fit.objective
    assert naked < expected - 2.0  # what a fit without a price would claim


def test_an_effect_that_is_not_there_costs_more_than_it_gains():
    gains = []
    for seed in range(200):
        y = data(seed)
        gains.append(explanation(y).score - explanation(y, ("first",)).score)
    assert np.mean(np.array(gains) > 0.0) < 0.05
    assert np.mean(gains) < -2.0


@pytest.mark.parametrize("effects", [(), ("first",)])
def test_a_run_left_out_is_foretold_as_by_a_refit_to_the_others(effects):
    y = data(strength=1.5)
    found = left_out_scores(explanation(y, effects))
    expected = [foretold(y, run, effects) for run in range(RUNS)]
    assert found == pytest.approx(expected, abs=0.05)
    inside = [f.log_likelihood for f in explanation(y, effects).fit.filtered]
    assert (found < np.array(inside) - 0.1).all()  # a run that was fitted looks better than it is


def test_a_run_left_out_is_foretold_alike_where_a_fit_ended_short_of_its_minimum():
    y = data(strength=1.5)
    ended_short = left_out_scores(explanation(y, ("first",), short=0.3))
    assert ended_short == pytest.approx(left_out_scores(explanation(y, ("first",))), abs=1e-6)


def test_the_ranking_is_by_runs_left_out_with_intervals_over_them():
    y = data(strength=1.5)
    causes = ("second", "first")
    first, second = ranking_of([explanation(y, (c,)) for c in causes], explanation(y))
    assert (first.cause, second.cause) == ("first", "second")
    gains = [foretold(y, run, ("first",)) - foretold(y, run) for run in range(RUNS)]
    half = 2.571 * np.std(gains, ddof=1) * RUNS**0.5  # Student's quantile of six runs
    assert first.score == pytest.approx(sum(gains), abs=0.2)
    assert first.interval == pytest.approx((sum(gains) - half, sum(gains) + half), abs=0.5)


def pair(y, problem=PROBLEM):
    best, other = (explanation(y, (name,), problem=problem) for name in ("first", "second"))
    return best, other, other.score - best.score


def test_explanations_are_alike_unless_the_evidence_tells_them_apart():
    best, other, gap = pair(data(strength=0.5))
    assert gap < 6.0
    assert alike(best, other)
    best, other, gap = pair(data(strength=6.0))
    assert gap > 30.0
    assert not alike(best, other)


def test_coloured_residuals_tell_less():
    """What tells two explanations apart in slow signals counts for less in slow noise."""
    slow = {name: np.sin(np.arange(LINEAR.size) / turn)[:, None]
            for name, turn in (("first", 160.0), ("second", 170.0))}  # fmt: skip
    white, coloured = [], []
    before = dict(COLUMNS)
    COLUMNS.update(slow)
    try:
        for seed in range(60):
            for memory, found in ((0.0, white), (0.95, coloured)):
                best, other, gap = pair(data(seed, 1.5, memory))
                if 6.0 < gap < 40.0:
                    found.append(alike(best, other))
    finally:
        COLUMNS.update(before)
    assert np.mean(white) < 0.3
    assert np.mean(coloured) > 0.6


def test_explanations_are_alike_where_one_run_speaks_for_one_and_the_others_do_not():
    """However much it says: the evidence counts it as if all had said it."""
    everywhere, once = data(strength=6.0), data()
    once[RUN_OF == 2] -= 15.0 * COLUMNS["first"][RUN_OF == 2, 0]
    best, other, gap = pair(once, OF_RUNS)
    assert gap > 30.0
    assert alike(best, other)
    assert agreed(*pair(everywhere, OF_RUNS)[:2])


class OfConditions(Stated):
    """Each run is one condition, averaged: what a run may be off by is its noise."""

    noise_is_of_runs = True


@pytest.mark.parametrize(("kind", "told"), [(Stated, False), (OfConditions, True)])
def test_one_condition_of_a_table_may_tell_and_one_run_of_a_series_may_not(kind, told):
    """As the steepest dive may tell a buoyancy from a drag. Runs have errors of their own."""
    before, shown = dict(COLUMNS), (RUN_OF == 2)[:, None]
    COLUMNS.update({name: column * shown for name, column in before.items()})
    problem = kind(OF_RUNS.residuals, KNOWN.values(), PATHS)
    try:
        best, other, gap = pair(data(strength=15.0), problem)
    finally:
        COLUMNS.update(before)
    assert gap > 30.0
    assert agreed(best, other) == told


def released(moved):
    """A real fit whose first coefficient lies so far off in each run, its prior lifted."""
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((RUNS, LINEAR.size // RUNS))
    slopes = LINEAR.slopes.reshape(RUNS, -1, COEFFICIENTS)
    y = noise - slopes[:, :, 0] * np.broadcast_to(moved, RUNS)[:, None]
    problem = Stated(lambda z, effects: y + slopes @ z, paths=PATHS)
    first = Coefficient(PATHS[0])
    return Explanation((first,), fit(problem, released=(first,)))


@pytest.mark.parametrize(("moved", "surely"), [(4.0, True), (1.5, False)])
def test_a_coefficient_departs_if_it_is_far_beyond_what_was_known(moved, surely):
    """Though runs left out say nothing of it: data hold it, with its prior or without."""
    assert last_departs(released(moved), LEVEL) == surely


def test_a_coefficient_that_runs_pull_apart_does_not_depart():
    found = released([4.0, 20.0, -12.0, 16.0, -8.0, 4.0])
    assert last_departs(released(found.fit.point.z[0]), LEVEL)  # were it so far off in all runs
    assert not last_departs(found, LEVEL)


def test_runs_that_tell_nothing_agree_as_seldom_as_the_policy_says():
    found = [agreed(*pair(data(seed), OF_RUNS)[:2]) for seed in range(300)]
    assert np.mean(found) < 2.0 * POLICY.disagreement + 0.05
