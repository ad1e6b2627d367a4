"""A fit made again: to convergence, in finer steps, with what its runs differ in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import FEWER_STEPS, USUAL_STEPS, Fit, fit
from fish_env.inference.estimate.free import DIFFERENCE, Free, linearise, spread_of
from fish_env.inference.estimate.gauss_newton import predicted_decrease
from fish_env.inference.estimate.information import gradient, information
from fish_env.inference.estimate.run_variation import in_proportion, pairs_beside
from fish_env.inference.estimate.spread import Likelihood, Spread, fit_spread
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem

AT_EDGE = 1.001
"""A lag is at the shortest that steps can have up to so many times that."""
MORE = 3
"""Most fits until one is converged."""


def finished(own: Fit) -> Fit:
    """A fit, iterated to convergence.

    A few steps under a few noise models are enough to screen causes by. Published estimates have
    to be the minimum, for their intervals to be true. Where runs have numbers of their own their
    likelihoods are rough, and a fit ends where steps follow that.
    """
    for _ in range(1 if spread_of(own.problem, own.noise).any() else MORE):
        if _left_to_gain(own) < POLICY.converged:
            break
        again = fit(own.problem, own.effects, own.point, own.noise, own.released, rounds=2)
        gained = own.objective - again.objective
        if gained > 0.0:
            own = again
        if gained < POLICY.converged:
            break
    return own


def arrived(own: Fit) -> Fit:
    """A fit that is near its minimum under its own noise, taken on if it is not.

    What a step more would still explain shows as another cause otherwise.
    """
    if _left_to_gain(own) < POLICY.evidence_doubt:
        return own
    return under_noise(own.problem, own, own.noise, FEWER_STEPS)


def _left_to_gain(own: Fit) -> float:
    """By how much -2 log likelihood would fall with the next step."""
    free = Free(own.problem, own.effects, own.released)
    vector, lin = free.pack(own.point), own.linearised
    hessian = information(lin.slopes, free.prior)
    pull = gradient(lin.slopes, lin.residuals, free.prior, vector)
    step = free.bounds.beside(vector).step(hessian, pull, vector)
    return predicted_decrease(hessian, pull, step)


def quietened(own: Fit) -> Fit:
    """A fit whose disturbance is at its limit, or one from first noise if that is likelier.

    A disturbance that stood in for a misfit moves coefficients, and beside these it stays the
    likeliest when what was missing has been found. It is told by how little noise a fit needs that
    begins with little.

    Args:
        own: the fit.
    """
    problem = own.problem
    if not problem.disturbance_at_limit(own.noise):
        return own
    noise = problem.default_noise()
    try:
        if problem.variations:
            numbers = np.where(spread_of(problem, noise) > 0.0, problem.variation, 0.0)
            problem = problem.with_variation(numbers, own.point, noise)
        again = taken_on(problem, own, noise)
    except np.linalg.LinAlgError:
        return own
    return again if again.objective < own.objective else own


def refined(own: Fit, rounds: int = 1) -> Fit:
    """The fit in the steps of published estimates, if it was made in longer ones."""
    if not own.problem.is_coarse:
        return own
    problem, start = own.problem.in_usual_steps(), (own.point, own.noise, own.released)
    return fit(problem, own.effects, *start, rounds=rounds, iterations=FEWER_STEPS)


def to_publish(own: Fit) -> Fit:
    """The fit in the steps of published estimates, iterated to convergence.

    Where runs have numbers of their own it is fitted once more at most: such a fit takes longest.
    """
    varied = bool(spread_of(own.problem, own.noise).any())
    finer = refined(own, rounds=2 if varied else 1)
    return finer if varied and finer is not own else finished(finer)


def search_steps(problem: Problem) -> int:
    """Most Gauss-Newton steps in a round of a fit that only compares causes.

    Where each run has a drive of its own a step moves its numbers too, which takes several times as
    long, and what is still missing moves estimates by more than further steps would.
    """
    return FEWER_STEPS if problem.drive.uneven else USUAL_STEPS


def taken_on(problem: Problem, at: CoarseFit | Fit, noise: Any, rounds: int = 2) -> Fit:
    """A fit taken on in the steps of a search, its noise estimated anew.

    Args:
        problem: the runs, perhaps not those of the fit.
        at: where to begin, and what is free.
        noise: noise model to begin from.
        rounds: most alternations between parameters and disturbance.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    start, steps = (at.effects, at.point, noise, at.released), search_steps(problem)
    return fit(problem, *start, rounds=rounds, iterations=steps)


def under_noise(
    problem: Problem,
    at: CoarseFit | Fit,
    noise: Any,
    iterations: int = USUAL_STEPS,
    give_up_above: float = np.inf,
) -> Fit:
    """A few steps on from a fit under one noise model.

    Args:
        problem: the runs, perhaps not those of the fit.
        at: where to begin, and what is free.
        noise: noise model, which is kept.
        iterations: most steps.
        give_up_above: stop where the objective will not get below this.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    return fit(
        problem, at.effects, at.point, noise, at.released, refit_noise=False,
        iterations=iterations, give_up_above=give_up_above,
    )  # fmt: skip


def to_search(problem: Problem, begin: CoarseFit | None = None) -> Problem:
    """The problem in the steps of fits that only compare causes.

    Where each run has a drive of its own such fits take longest, what is still missing moves
    estimates by far more than long steps do, and all that is compared is in the same steps: finer
    ones are for estimates to be published.

    Args:
        problem: the problem.
        begin: where a fit begins, if that is known.
    """
    if not problem.drive.uneven:
        return problem
    long = problem.with_long_steps()
    return long if begin is None else following(long, begin)


def following(problem: Problem, begin: CoarseFit) -> Problem:
    """The problem, in the usual steps if a fit begins with a lag as short as long ones can have.

    The right lag may be shorter. With another one runs lose beats of their tails, and no further
    cause is found.

    Args:
        problem: the problem, perhaps in long steps.
        begin: where a fit begins.
    """
    free = Free(problem, begin.effects, begin.released)
    vector = free.pack(begin.point)
    if not any(g.off < vector[g.number] <= AT_EDGE * g.least for g in free.bounds.gaps):
        return problem
    return problem.in_usual_steps()


def differences(own: Fit) -> Spread | None:
    """What the runs of a fit differ in; None where they tell no spread, or have usual ones."""
    problem = own.problem
    enough = problem.run_count >= POLICY.fewest_runs_for_spread
    if not problem.variations or not enough or problem.drive.uneven:
        return None
    return run_variation(own)


def run_variation(own: Fit) -> Spread:
    """What the runs of a fit differ in, as far as it is strongly indicated.

    Args:
        own: the fit; its weighting is held.
    """
    variations = own.problem.variations
    differing = np.array([not variation.shared for variation in variations])
    return fit_spread(own_likelihoods(own)(np.eye(len(variations))[:, differing]), variations)


def own_likelihoods(own: Fit) -> Callable[[FloatArray], Likelihood]:
    """How likely spreads are, in usual ones, in the linear model about a fit.

    Args:
        own: the fit; its weighting is held.

    Returns:
        The likelihood from what all runs have in common, (K, m) as :class:`Likelihood` takes it.
    """
    problem, usual = own.problem, np.array([v.usual for v in own.problem.variations])
    free = Free(problem, own.effects, own.released)
    vector, lin = free.pack(own.point), own.linearised
    if lin.marginal is not None:
        lin = linearise(problem, free, vector, own.noise, own.filtered)
    steps = DIFFERENCE * usual
    slopes = problem.variation_slopes(own.point, own.noise, own.filtered, steps) * usual
    # As in a descent: two ways to work out the same slope differ by more than noise.
    beside = pairs_beside(problem.variations, free.ids)
    slopes = in_proportion(slopes, [(own, lin.slopes[:, i]) for own, i in beside])
    prior = information(lin.slopes, free.prior), free.prior * vector
    at = problem.variation / usual

    def likelihood(common: FloatArray) -> Likelihood:
        return Likelihood(lin.residuals, lin.slopes, slopes, at, lin.run_of, *prior, common)

    return likelihood


def with_run_variation(
    own: Fit, runs: Problem | None = None, begin: CoarseFit | None = None
) -> Fit:
    """The fit, made again where its runs differ by more, or less, than it allows for.

    A few runs tell no spread. Runs whose drive is uneven differ in everything: every spread is then
    the usual one from the first fit on, and fits move the runs' numbers themselves.

    Args:
        own: the fit.
        runs: those of the fit with numbers to begin from; default: as in the fit.
        begin: where the new fit begins, and what is free in it; default: as in the fit.
    """
    problem, noise, found = runs or own.problem, own.noise, differences(own)
    if found is not None and (found.sd.any() or own.noise.spread.any()):
        # The fit moves them, run by run, as far as that helps.
        numbers = np.where(found.sd > 0.0, problem.variation, 0.0)
        problem = problem.with_variation(numbers, own.point, own.noise)
        noise = replace(own.noise, spread=found.sd)
    if noise is own.noise and begin is None:
        return own
    return taken_on(problem, begin or own, noise)
