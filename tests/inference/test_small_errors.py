"""Small errors of all else: what they cost and explain, and how sure they leave estimates."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fish_env.inference.effects import EffectParameter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.partial import beyond_small_errors, needed
from fish_env.inference.policy import POLICY
from fish_env.inference.rivals import rivals_of, told_apart_among_small_errors
from fish_env.inference.small_errors import SHARES, SmallErrors
from tests.inference.stated import DeclaredEffect, Stated, effect, size_of

RUNS, SAMPLES = 4, 50
CAUSE, TWIN = "cause", "twin"
USUAL = POLICY.small_error * np.sqrt(POLICY.small_errors)
"""Usual spread of a size that may reach one."""


class Linear(Stated):
    """Residuals in which each of many effects acts along its own direction.

    Args:
        along: (effects, runs, samples) directions; those of :data:`CAUSE` and its twin first.
        sizes: what acts, by name.
        rng: of the noise.
    """

    def __init__(self, along, sizes, rng, **declared):
        names = [CAUSE, TWIN, *(f"small {i}" for i in range(len(along) - 2))]
        self.along = dict(zip(names, along, strict=True))
        noise = rng.standard_normal(along.shape[1:])
        own = {name: sizes.get(name, 0.0) for name in names}

        def residuals(z, effects):
            return noise + sum(
                (own[name] - effects[size_of(name)]) * self.along[name] for name in names
            )

        super().__init__(residuals, [effect(name, **declared) for name in names])

    def fitted(self, *names):
        return Explanation(names, fit(self, names))


def directions(rng, count, strength=40.0):
    """Directions (count, runs, samples) of random course."""
    return strength * rng.standard_normal((count, RUNS, SAMPLES)) / np.sqrt(RUNS * SAMPLES)


def small(rng, count, share=1.0):
    """Sizes of small errors, of a share of their usual spread."""
    return {f"small {i}": size for i, size in enumerate(share * USUAL * rng.standard_normal(count))}


@pytest.mark.parametrize("share", [0.0, 4.0])
def test_the_gain_is_that_of_the_exact_evidence(share):
    rng = np.random.default_rng(1)
    along = directions(rng, 8)
    problem = Linear(along, {CAUSE: 0.7, **small(rng, 6, share)}, rng)
    own = problem.fitted(CAUSE)
    left = own.fit.linearised.residuals
    columns = along[1:].reshape(7, -1)
    # With all that is not known integrated out: the cause under no prior, the errors under theirs.
    broad = 1e2 * along[0].reshape(1, -1)

    def evidence(spread):
        rows = np.vstack([broad, spread * columns])
        covariance = np.eye(left.size) + rows.T @ rows
        return -2.0 * multivariate_normal.logpdf(left, np.zeros(left.size), covariance)

    exact = max(evidence(0.0) - evidence(s * USUAL) for s in SHARES)
    assert own.small_errors.gain() == pytest.approx(exact, abs=0.05)


def test_where_nothing_else_is_wrong_estimates_stay_as_sure_as_they_are():
    rng = np.random.default_rng(2)
    own = Linear(directions(rng, 20, 200.0), {CAUSE: 0.7}, rng).fitted(CAUSE)
    assert own.small_errors.widened() is own.fit


def test_intervals_hold_the_truth_among_small_errors():
    """Those of the fit alone hold it much too seldom."""
    rng, held, draws = np.random.default_rng(3), np.zeros(2), 200
    for _ in range(draws):
        along = directions(rng, 14, 200.0)
        along[2:] += 2.0 * along[0]  # what small errors do a refit of the cause follows
        own = Linear(along, {CAUSE: 0.7, **small(rng, 12)}, rng).fitted(CAUSE)
        ends = [f.interval(size_of(CAUSE)) for f in (own.fit, own.small_errors.widened())]
        held += [low < 0.7 < high for low, high in ends]
    alone, among = held / draws
    assert among >= 0.93
    assert alone < 0.5


def test_likelihood_intervals_grow_as_normal_ones_do():
    rng = np.random.default_rng(4)
    own = Linear(directions(rng, 14, 200.0), {CAUSE: 0.7, **small(rng, 12)}, rng).fitted(CAUSE).fit
    size = size_of(CAUSE)
    profiled = replace(own, profiles={size: own.interval(size)})
    likely, normal = (SmallErrors.of(one).widened().interval(size) for one in (profiled, own))
    assert likely == pytest.approx(normal)


def mistaken(rng):
    """Runs in which a small error makes the wrong one of two look-alikes explain more."""
    along = directions(rng, 8, 200.0)
    along[1] = along[0] + 0.05 * along[2]
    sizes = {f"small {i}": 0.05 * (-1.0) ** i for i in range(6)}
    return Linear(along, {CAUSE: 0.7, **sizes}, rng)


def test_what_a_small_error_makes_likelier_is_no_more_than_a_rival():
    problem = mistaken(np.random.default_rng(5))
    right, wrong = problem.fitted(CAUSE), problem.fitted(TWIN)
    assert wrong.score < right.score - 2.0 * POLICY.evidence_doubt
    assert rivals_of(wrong, [right]) == ()
    best, rivals = told_apart_among_small_errors([wrong, right])
    assert right in (best, *rivals)


def test_a_look_alike_does_not_come_back_as_a_small_error():
    rng = np.random.default_rng(6)
    along = directions(rng, 8, 200.0)
    problem = Linear(along, {CAUSE: 0.1}, rng)
    best, rivals = told_apart_among_small_errors([problem.fitted(TWIN), problem.fitted(CAUSE)])
    assert (best.causes, rivals) == ((CAUSE,), ())


def test_oscillations_are_left_out():
    phase = EffectParameter("phase", "rad", 0.0, plausible=(-np.pi, np.pi), shapes=True)
    height = EffectParameter("height", "m", 0.0, plausible=(0.0, 1.0))
    x = np.random.default_rng(7).standard_normal((RUNS, SAMPLES))
    wave = DeclaredEffect("wave", (height, phase))

    def residuals(z, effects):
        return x * (1.0 - 9.0 * effects[EffectParameterId("wave", "height")])

    assert SmallErrors.of(fit(Stated(residuals, [wave]), ())).names == ()


def test_beside_something_unknown_a_cause_that_small_errors_stand_in_for_is_not_named():
    problem = mistaken(np.random.default_rng(8))
    both = problem.fitted(CAUSE, TWIN)
    told = []
    left = beyond_small_errors(both, -11.0, told.append)
    assert left.causes in {(CAUSE,), (TWIN,)}
    assert "small errors explain as much" in told[0]


def test_beside_something_unknown_a_cause_that_acts_stays_among_small_errors():
    rng = np.random.default_rng(9)
    own = Linear(directions(rng, 14, 200.0), {CAUSE: 0.7, **small(rng, 12)}, rng).fitted(CAUSE)
    assert beyond_small_errors(own, -11.0) is own
    assert needed(own) is own


def test_a_cause_on_which_runs_do_not_agree_is_not_needed():
    rng = np.random.default_rng(10)
    along = directions(rng, 2, 60.0)
    along[0, 1:] *= 0.05  # one run alone shows it
    told = []
    assert needed(Linear(along, {CAUSE: 0.15}, rng).fitted(CAUSE), told.append) is None
    assert "a fit without it explains as much" in told[0]
