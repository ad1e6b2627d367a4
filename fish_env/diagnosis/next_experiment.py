"""Which manoeuvre would separate what these runs leave open.

For each manoeuvre of a menu the runs still to be flown are simulated by the present explanation.
A rival is separated by the part of its difference that the coefficients, held by the data so far
and their priors, cannot follow (T-optimality: Atkinson and Fedorov, 1975).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.diagnosis.manoeuvres import DURATION_S, MENU, Manoeuvre
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification import open_loop
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem, series_of
from fish_env.inference.attribution import Attribution
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import diverged
from fish_env.inference.hypotheses import CauseId, EffectParameterId, effects_of, listed
from fish_env.inference.preconditions import Precondition
from fish_env.inference.probes import effect_values
from fish_env.inference.problem import Point, Problem
from fish_env.inference.vehicle import Effect
from fish_env.inference.verdict import Verdict
from fish_env.model.state import BASE_STATES

RATE_HZ = 25.0
STEP_S = 0.02
"""Longest step of a simulated manoeuvre; shorter where the fit has shorter ones, for quick lags."""


@dataclass(frozen=True)
class Proposal:
    """A manoeuvre to fly.

    Attributes:
        name: what it does.
        schedule: rows of ``t`` (s) and commands (SI), each held until the next.
        separates: what it would tell from the present explanation.
        separation: mean squared distance between rivals and the present explanation, in noise
            units, that a refit cannot close.
    """

    name: str
    schedule: tuple[Mapping[str, float], ...]
    separates: tuple[str, ...]
    separation: float


def propose(
    attribution: Attribution, verdict: Verdict, shown: Sequence[Precondition]
) -> Proposal | None:
    """The manoeuvre of the menu that separates rivals, or shows causes the runs could not."""
    fit = attribution.accepted.fit
    others = {r.causes: r.fit.point for r in attribution.rivals}
    rivals = rivals_of(verdict, others, shown, lambda name: plausible(fit, name))
    if not rivals:
        return None
    points = list(rivals.values())
    return best_of(verdict, tuple(rivals), [(separation(fit, points, m), m) for m in MENU])


def best_of(
    verdict: Verdict, rivals: Sequence[str], found: Sequence[tuple[FloatArray, Manoeuvre]]
) -> Proposal | None:
    """The manoeuvre that separates best; None where none shows what the runs could not.

    Args:
        verdict: the verdict.
        rivals: what the present explanation is to be told from.
        found: squared distance of each rival (rivals,), and the manoeuvre.
    """
    best, manoeuvre = max(found, key=lambda pair: float(np.mean(np.log1p(pair[0]))))
    apart = dict(zip(rivals, best.tolist(), strict=True))
    if verdict.name != "ambiguous":  # of rivals the best manoeuvre is wanted, however good it is
        enough = CHECKS.shown_separation
        apart = {name: size for name, size in apart.items() if size > enough}
    if not apart:
        return None
    separated = float(np.mean(list(apart.values())))
    return Proposal(manoeuvre.name, manoeuvre.schedule, tuple(apart), separated)


def rivals_of(
    verdict: Verdict,
    others: Mapping[tuple[CauseId, ...], Point],
    shown: Sequence[Precondition],
    plausible: Callable[[str], Point],
) -> dict[str, Point]:
    """What the present explanation is to be told from: other fits, or effects not seen.

    Args:
        verdict: the verdict.
        others: causes of each rival -> its fit.
        shown: what the data could show.
        plausible: the present explanation with an effect at a plausible size.
    """
    if verdict.name == "ambiguous":
        return {listed(causes, " + "): point for causes, point in others.items()}
    if verdict.name not in ("no_misfit", "not_excited"):
        return {}
    return {p.name: plausible(p.name) for p in shown if not p.excited}


def plausible_sizes(effect: Effect) -> dict[str, float]:
    """Parameters of an effect that acts as strongly as is plausible."""
    sizes = {}
    for p in effect.parameters:
        low, high = p.plausible
        shaping = 0.5 * (low + high) if p.shapes else p.far_end(p.neutral)
        sizes[p.name] = low if np.isinf(p.neutral) else shaping
    return sizes


def plausible(fit: Fit, name: str) -> Point:
    """The present explanation with an effect at a plausible size."""
    values = effect_values(fit.problem, name, plausible_sizes(fit.problem.known[name]))
    bounds = {f.id: (f.lower, f.upper) for f in fit.problem.freedoms([name])}
    clipped = {id: float(np.clip(value, *bounds[id])) for id, value in values.items()}
    return Point(fit.point.z, {**fit.point.effects, **clipped})


def separation(fit: Fit, rivals: Sequence[Point], manoeuvre: Manoeuvre) -> FloatArray:
    """Squared distance of each rival that a refit cannot close, shape (rivals,)."""
    slopes, differences = changes_on(flown(fit, manoeuvre), fit, fit.noise, rivals)
    return unfollowed(slopes, differences, information_of(fit))


def changes_on(
    problem: Problem, fit: Fit, noise: Any, rivals: Sequence[Point]
) -> tuple[FloatArray, FloatArray]:
    """Slopes by the coefficients (D, n), and what each rival changes (D, m), on other data.

    Args:
        problem: the other data.
        fit: the present explanation.
        noise: its noise on them.
        rivals: points, m of them.
    """
    filtered = problem.filtered(fit.point, noise)
    count, step = len(problem.baseline), problem.coefficient_step
    nudged = [replace(fit.point, z=fit.point.z + step * np.eye(count)[i]) for i in range(count)]
    z, effects = _lanes(problem, [fit.point, *nudged, *rivals])
    changes = problem.changes(z, effects, noise, filtered)
    changes[diverged(changes)] = 0.0  # nothing is known of what a simulation cannot follow
    return changes[:count].T / step, changes[count:].T


def unfollowed(slopes: FloatArray, differences: FloatArray, information: FloatArray) -> FloatArray:
    """Squared length of each difference after the best move along the slopes.

    Args:
        slopes: (D, n) what the coefficients can do on the new run.
        differences: (D, m) rivals.
        information: (n, n) what holds the coefficients already, priors included.
    """
    move = np.linalg.solve(slopes.T @ slopes + information, slopes.T @ differences)
    left = differences - slopes @ move
    held = np.einsum("im,ij,jm->m", move, information, move)
    return np.asarray(np.einsum("dm,dm->m", left, left) + held)


def information_of(fit: Fit) -> FloatArray:
    """What holds the coefficients already, priors included (n, n)."""
    count = len(fit.problem.baseline)
    slopes = fit.linearised.slopes[:, :count]
    return np.asarray(slopes.T @ slopes + np.eye(count))


def _lanes(
    problem: Problem, points: Sequence[Point]
) -> tuple[FloatArray, dict[EffectParameterId, FloatArray]]:
    ids = list(dict.fromkeys(id for point in points for id in point.effects))
    neutral = problem.neutral(effects_of(ids))
    effects = {id: np.array([point.effects.get(id, neutral[id]) for point in points]) for id in ids}
    return np.column_stack([point.z for point in points]), effects


def flown(fit: Fit, manoeuvre: Manoeuvre) -> SeriesProblem:
    """The manoeuvre as the present explanation would swim it, without noise."""
    blank = _blank(series_of(fit), manoeuvre)
    on_blank = series_of(fit).with_runs([blank])
    predicted = -open_loop.errors(on_blank, fit.point, fit.noise)[0]
    return series_of(fit).with_runs([replace(blank, measured=predicted)])


def _blank(problem: SeriesProblem, manoeuvre: Manoeuvre) -> RunData:
    """A run of zeros: prediction errors on it are the prediction, negative."""
    clock = np.arange(0.0, DURATION_S, 1.0 / RATE_HZ)
    step = min(STEP_S, problem.longest_step)
    substeps = np.full(len(clock), int(np.ceil(1.0 / RATE_HZ / step - 1e-9)), np.int64)
    state = np.zeros(len(BASE_STATES))
    state[3] = 1.0
    state[2] = np.median([run.state0[2] for run in problem.runs])
    return RunData(
        id=manoeuvre.name,
        condition=None,
        clock=clock,
        substeps=substeps,
        fresh=np.zeros(len(clock), bool),
        command_times=manoeuvre.times_s,
        command_values=manoeuvre.values,
        measured=np.zeros((len(clock), len(problem.channels))),
        state0=state,
        covariance0=problem.runs[0].covariance0,
        phase_known=True,
        as_measured=False,
    )
