"""Causes beside something unknown: those that act are named, imitations are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.inference.adequacy import contradicts_priors
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.partial import (
    confirmed,
    independent,
    owed_to_coefficients,
)
from fish_env.inference.pipeline import infer
from fish_env.inference.problem import Point
from fish_env.inference.simulated import sustained
from fish_env.inference.stand_ins import StandIns
from fish_env.inference.vehicle import Coefficients, Drive
from tests.inference.boat import sail
from tests.inference.boat_problem import BoatProblem
from tests.inference.stated import Directions, Stated
from tests.inference.test_boat import BIAS, EAST, FITTED, NORTH, problems, wind

THRESHOLD = -10.0


LONG = pytest.mark.long
SEEDS = [3, pytest.param(4, marks=LONG), pytest.param(5, marks=LONG)]
"""Of whole searches, of which `make test` makes one."""


@pytest.mark.parametrize("seed", SEEDS)
def test_a_cause_beside_an_unknown_force_is_named(seed):
    result = infer(*problems(seed, {NORTH: 0.15, EAST: -0.2}, foreign=wind), seed=seed)
    assert result.verdict.name == "partial"
    assert result.verdict.causes == ("current",)


class LongSteps(BoatProblem):
    """A boat in the steps of a search, with a disturbance at its limit: nothing is published yet.

    The steps of published estimates are those of a boat.
    """

    def disturbance_at_limit(self, noise):
        return ("a disturbance at its limit",)

    is_coarse = True

    def in_usual_steps(self):
        return BoatProblem(self.runs)


def test_what_is_published_of_it_is_fitted_in_usual_steps():
    fitted, final = problems(3, {NORTH: 0.15, EAST: -0.2}, foreign=wind)
    result = infer(LongSteps(fitted.runs), final, seed=3)
    assert result.verdict.name == "partial"
    assert type(result.attribution.accepted.fit.problem) is BoatProblem


@pytest.mark.parametrize("seed", SEEDS)
def test_a_cause_that_a_force_of_no_origin_replaces_is_not_named(seed):
    """A rudder askew makes a moment with the square of the speed."""
    result = infer(*problems(seed, {BIAS: 0.06}, foreign=wind), seed=seed)
    assert result.verdict.name == "outside_library"


def test_an_imitation_of_an_unknown_force_is_not_confirmed():
    boat = BoatProblem(sail(np.random.default_rng(2), FITTED, foreign=wind))
    imitation = Explanation(("current",), fit(boat, ("current",)))
    assert confirmed(imitation, THRESHOLD) is None


def test_where_nothing_is_unknown_a_cause_is_confirmed():
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    right = Explanation(("current",), fit(boat, ("current",)))
    assert confirmed(right, THRESHOLD) is right
    assert StandIns(right, THRESHOLD).log_p()["current"] < THRESHOLD


def test_a_removed_cause_costs_what_a_fit_without_it_loses():
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.05}))
    right = fit(boat, ("current",))
    removed = StandIns(Explanation(("current",), right), THRESHOLD).removed("current")
    without = fit(boat, (), noise=right.noise, refit_noise=False, iterations=10)
    assert removed.loss == pytest.approx(without.objective - right.objective, rel=0.1)


def test_causes_removed_together_cost_what_a_fit_without_them_loses():
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.05, BIAS: 0.01}))
    right = fit(boat, ("current", "rudder_bias"))
    removed = StandIns(Explanation(("current", "rudder_bias"), right), THRESHOLD).removed
    without = fit(boat, (), noise=right.noise, refit_noise=False, iterations=10)
    lost = without.objective - right.objective
    assert removed("current", "rudder_bias").loss == pytest.approx(lost, rel=0.1)
    assert removed("rudder_bias", "current").loss == pytest.approx(lost, rel=0.1)
    assert removed("current").loss < lost


@pytest.mark.parametrize("reverse", [False, True])
def test_a_coefficient_removed_with_an_effect_gets_its_prior_back(reverse):
    """As the whole quadratic model has it, with the prior in place and the effect held off."""
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    drag = boat.baseline.ids[0]
    own = fit(boat, ("current",), released=(drag,))
    names = (drag, "current")[:: -1 if reverse else 1]
    forces = StandIns(Explanation((drag, "current"), own), THRESHOLD)
    removed = forces.removed(*names)

    held = [own.ids.index(id) for id in (NORTH, EAST)]
    at = [i for i in range(len(own.ids)) if i not in held]
    hessian, z = forces.projector.hessian.copy(), own.point.z[0]
    hessian[0, 0] += 1.0
    step = np.zeros(len(own.ids))
    step[held] = -own.estimates[held]
    pull = hessian[np.ix_(at, held)] @ step[held]
    pull[0] += z
    step[at] = -np.linalg.solve(hessian[np.ix_(at, at)], pull)
    lost = step @ hessian @ step + 2.0 * z * step[0] + z**2
    np.testing.assert_allclose(removed.shift, step[removed.own], rtol=1e-6)
    assert removed.loss == pytest.approx(lost, rel=1e-6)


class Forced(Stated):
    """A problem whose generic forces act along given directions (forces, samples of all runs)."""

    forces: np.ndarray

    def generic_terms(self, fit):
        return Directions(self.forces)


def test_the_most_indicated_force_need_not_come_first():
    """One is nearly what a cause does, two others are together; behind the one it takes three."""
    rng = np.random.default_rng(8)
    shape = (3, 40)
    a, b, *others = np.linalg.qr(rng.standard_normal((120, 5)))[0].T
    one, other = (
        EffectParameter(name, "-", 0.0, plausible=(-1.0, 1.0)) for name in ("one", "other")
    )
    noise = rng.standard_normal(shape)
    at = [EffectParameterId("wide", name) for name in ("one", "other")]

    def residuals(z, effects):
        left = (0.5 - effects[at[0]]) * a + (0.5 - effects[at[1]]) * b
        return noise + 60.0 * left.reshape(shape)

    stated = Forced(residuals, (DeclaredEffect("wide", (one, other)),))
    stated.forces = np.array([a + b, a, b]) + [[0.6], [0.05], [0.05]] * np.array(others)
    point = Point(stated.start.z, dict.fromkeys(at, 0.4))
    found = Explanation(("wide",), fit(stated, ("wide",), point))
    assert StandIns(found, THRESHOLD).replaced(found.causes) == ["wide"]
    stated.forces = stated.forces[:2]
    assert StandIns(found, THRESHOLD).replaced(found.causes) == []


def test_a_cause_is_judged_beside_what_was_rejected_before_it():
    """In the linear model of one fit as in a fit of its own."""
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    both = Explanation(("current", "rudder_bias"), fit(boat, ("current", "rudder_bias")))
    forces = StandIns(both, THRESHOLD)
    assert forces.replaced(both.causes) == ["rudder_bias"]
    again = fit(boat, ("current",), noise=both.fit.noise, refit_noise=False, iterations=10)
    alone = Explanation(("current",), again)
    after = forces.log_p(("rudder_bias",))
    assert after == pytest.approx(StandIns(alone, THRESHOLD).log_p(), rel=0.2)


def both_fitted(seed, north, bias):
    """A boat in a wind that nobody knows of, fitted with a current and a rudder askew."""
    values = {NORTH: north, BIAS: bias}
    boat = BoatProblem(sail(np.random.default_rng(seed), FITTED, values, foreign=wind))
    return Explanation(("current", "rudder_bias"), fit(boat, ("current", "rudder_bias")))


@pytest.mark.parametrize("seed", [4, 5, 8, 9])
def test_a_cause_that_a_force_replaces_takes_no_other_with_it(seed):
    """Without the rudder askew, whose place forces may take, forces hide the current too."""
    found = confirmed(both_fitted(seed, 0.03, 0.05), THRESHOLD)
    assert found is not None
    assert found.causes == ("current",)


@pytest.mark.parametrize("bias", [0.02, 0.05])
@pytest.mark.parametrize("seed", [4, 5, 8, 9])
def test_an_imitation_beside_a_cause_that_a_force_replaces_is_not_confirmed(seed, bias):
    """What explains the wind as a current does is no current beside the rudder either."""
    assert confirmed(both_fitted(seed, 0.0, bias), THRESHOLD) is None


@pytest.mark.parametrize("seed", [4, 5, 8, 9])
def test_beside_a_doubtful_cause_or_forces_the_better_description_counts(seed):
    """As much is left of a cause as beside the doubtful one, or beside the forces, or between."""
    both = both_fitted(seed, 0.03, 0.05)
    forces = StandIns(both, THRESHOLD)
    again = fit(
        both.fit.problem, ("current",), noise=both.fit.noise, refit_noise=False, iterations=10
    )
    alone = StandIns(Explanation(("current",), again), THRESHOLD).log_p()["current"]
    beside, either = (forces.log_p(doubtful)["current"] for doubtful in ((), ("rudder_bias",)))
    assert min(beside, alone) <= either <= max(beside, alone)
    assert either < alone / 1.5


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_a_cause_that_improves_no_simulation_is_dropped(seed):
    """No rudder is askew: the current is all that simulations get better by."""
    rng = np.random.default_rng(seed)
    boat = BoatProblem(sail(rng, FITTED, {NORTH: 0.15, EAST: -0.2}, foreign=wind))
    both = Explanation(("current", "rudder_bias"), fit(boat, ("current", "rudder_bias")))
    found = sustained(both)
    assert found is not None
    assert found.causes == ("current",)


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_a_cause_that_improves_every_simulation_stays(seed):
    rng = np.random.default_rng(seed)
    boat = BoatProblem(sail(rng, FITTED, {BIAS: 0.06}, foreign=wind))
    right = Explanation(("rudder_bias",), fit(boat, ("rudder_bias",)))
    assert sustained(right) is right


@pytest.mark.parametrize("certain", [True, False])
def test_what_was_measured_of_a_drive_needs_no_simulation(certain):
    rng = np.random.default_rng(4)
    boat = BoatProblem(sail(rng, FITTED, {NORTH: 0.15, EAST: -0.2}, foreign=wind))
    boat.drive = Drive({BIAS: 0.0}, known=True, certain=certain)
    both = Explanation(("current", "rudder_bias"), fit(boat, ("current", "rudder_bias")))
    found = sustained(both)
    assert ("rudder_bias" in found.causes) == certain
    assert "current" in found.causes
    alone = Explanation(("rudder_bias",), fit(boat, ("rudder_bias",)))
    assert (confirmed(alone, THRESHOLD) is not None) == certain


def far_off(own, z, size=1.0):
    """The fit of a current with all coefficients so far off, and a current so many times as fast.

    The estimates are stated, not fitted.
    """
    current = {id: size * own.point.effects[id] for id in (NORTH, EAST)}
    estimates = own.estimates.copy()
    for id, value in current.items():
        estimates[own.ids.index(id)] = value
    point = Point(np.full_like(own.point.z, z), {**own.point.effects, **current})
    return replace(own, point=point, estimates=estimates)


def test_no_cause_that_depends_on_coefficients_is_believed_where_they_contradict_their_priors():
    """A boat whose coefficients are all four prior deviations off is not the boat described."""
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    right = fit(boat, ("current",))
    off = far_off(right, 4.0, size=0.02)
    said: list[str] = []
    assert confirmed(Explanation(("current",), off), THRESHOLD, said.append) is None
    assert "contradict their priors" in said[0]
    assert not contradicts_priors(right)
    assert contradicts_priors(off)


def test_what_effects_owe_to_coefficients_is_what_a_fit_with_nominal_ones_lacks():
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    free = fit(boat, ("current",))
    held = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    known = boat.baseline
    held.baseline = Coefficients(known.paths, known.mean, 1e-8 * np.diag(known.sd**2), known.bounds)
    nominal = fit(held, ("current",), noise=free.noise, refit_noise=False, iterations=10)
    owed = owed_to_coefficients(free)
    for path in (NORTH, EAST):
        change = free.point.effects[path] - nominal.point.effects[path]
        assert owed[path] == pytest.approx(change, rel=0.2, abs=2e-4)


@pytest.mark.parametrize(
    ("off", "size", "expected"),
    [(0.0, 0.02, {"current"}), (4.0, 0.02, set()), (4.0, 1.0, {"current"})],
)
def test_a_cause_is_independent_of_coefficients_if_it_owes_them_little_of_what_it_is(
    off, size, expected
):
    """With nominal coefficients it owes nothing; else as much is much of a slow current only."""
    boat = BoatProblem(sail(np.random.default_rng(7), FITTED, {NORTH: 0.15, EAST: -0.2}))
    assert independent(far_off(fit(boat, ("current",)), off, size)) == expected
