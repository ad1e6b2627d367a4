"""Many causes at once: chosen in the linear model, fitted together, kept where each is needed.

A contest of full fits for every cause takes longer with each cause that is already there. Once the
largest causes are known, the others are small, and the linear model of the screen tells how they
act together: causes are picked in it one after another, tried in coarse fits along a chain, and
fitted together once. Those that are not significant beside the others are dropped. Source: forward
selection in a linear model (orthogonal matching pursuit; Pati, Rezaiifar and Krishnaprasad, 1993).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.adequacy import implausible_estimates
from fish_env.inference.elimination import insignificant, off_values
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.products import inner
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import Screen
from fish_env.inference.starts import starts
from fish_env.inference.tails import chi2_log_tail

Report = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Pick:
    """A cause chosen in the linear model.

    Attributes:
        signal: the cause at its best alternative.
        log_p: of what it explains beside the causes picked before it.
    """

    signal: Signal
    log_p: float


def picked(
    projector: Projector, shown: Screen, most: int, least: float = 0.0, relaxed_log_p: float = 0.0
) -> list[Pick]:
    """Effects that explain more each, beside those picked before, than chance would.

    Args:
        projector: of the fit that was screened.
        shown: all causes against it.
        most: effects to pick at most.
        least: statistic below which a simulation error explains an effect.
        relaxed_log_p: added to the log p-value that makes an effect significant.
    """
    weight = np.sqrt(projector.prior)[:, None]
    candidates = [s for s in shown.signals if s.cause.is_effect and s.followed is not None]
    left = [s.left for s in candidates]
    pulls = [weight * s.followed for s in candidates if s.followed is not None]
    score = [s.score.copy() for s in candidates]
    info = [s.projected.copy() for s in candidates]
    whole = [s.projected for s in candidates]
    found: list[Pick] = []
    directions: list[tuple[FloatArray, FloatArray]] = []
    taken: set[str] = set()
    while len(found) < most:
        best, best_p = -1, np.inf
        for i, s in enumerate(candidates):
            if s.cause.name in taken or not _independent(info[i], whole[i]):
                continue
            statistic = float(score[i] @ np.linalg.solve(info[i], score[i])) / s.variance_inflation
            log_p = float(chi2_log_tail(statistic, s.freedom))
            if statistic >= least and log_p < best_p:
                best, best_p = i, log_p
        if best < 0 or best_p >= shown.threshold + relaxed_log_p:
            return found
        found.append(Pick(candidates[best], best_p))
        taken.add(candidates[best].cause.name)
        # What the pick leaves of all others: one step of a block Cholesky factorisation.
        rows, pull = left[best].copy(), pulls[best].copy()
        for basis, along in directions:
            shared = inner(basis, left[best]) + along.T @ pulls[best]
            rows -= basis @ shared
            pull -= along @ shared
        root = np.linalg.inv(np.linalg.cholesky(info[best])).T
        basis, along, own_score = rows @ root, pull @ root, root.T @ score[best]
        directions.append((basis, along))
        for i in range(len(candidates)):
            shared = inner(basis, left[i]) + along.T @ pulls[i]
            info[i] = info[i] - shared.T @ shared
            score[i] = score[i] - shared.T @ own_score
    return found


def _independent(info: FloatArray, whole: FloatArray) -> bool:
    """Whether something of an effect is left beside those picked."""
    return bool(np.all(np.diag(info) > 0.05 * np.diag(whole)))


def pursued(
    current: Explanation,
    shown: Screen,
    report: Report,
    least: float = 0.0,
    relaxed_log_p: float = 0.0,
) -> Explanation:
    """The explanation with all causes that show beside it and are needed; itself without such.

    Args:
        current: causes accepted so far.
        shown: all causes against it.
        report: told what is being done.
        least: statistic below which a simulation error explains a cause.
        relaxed_log_p: added to the log p-value that makes a cause significant.
    """
    room = POLICY.most_causes - len(current.causes)
    picks = picked(Projector(current.fit.extrapolated), shown, room, least, relaxed_log_p)
    if not picks:
        return current
    like_found = {n for c in current.causes for n in _confusable(current, c)}
    first = picks[0].signal.cause.name
    # Two delays in a row are nearly one: the second shows no more, and what shows is its echo.
    alike = like_found | set(_confusable(current, first))
    echoes = [s for s in shown.best() if s.cause.name in alike - {first}]
    causes, coarse = _chained(current, [pick.signal for pick in picks], echoes, report)
    if not causes:
        return current
    report(f"fitting {', '.join(causes)} together")
    fitted = _fitted(current, coarse)
    if fitted is None:
        return current
    found = Explanation((*current.causes, *causes), fitted)
    idle = insignificant(fitted, found.causes, shown.threshold)
    if not set(causes) - set(idle):
        return current
    report(f"fitting without {', '.join(idle)}" if idle else "fitting what the runs differ in")
    found = found.varied(beside_misfit=True, dropped=idle)
    better = found.score < current.score - POLICY.evidence_doubt
    return found if better and not implausible_estimates(found.fit) else current


def _confusable(current: Explanation, name: str) -> tuple[str, ...]:
    known = current.fit.problem.known
    return known[name].confusable_with if name in known else ()


def _fitted(current: Explanation, coarse: CoarseFit) -> Fit | None:
    """The full fit from a coarse one, with the noise that it leaves.

    In steps that are the same for all effects: finer ones, for those that are not smooth, are for
    estimates to be published.
    """
    problem = current.fit.problem.without_refinement()
    start = (coarse.effects, coarse.point, current.fit.noise, coarse.released)
    return reached(lambda: fit(problem, *start, rounds=2, iterations=3))


def _chained(
    current: Explanation, signals: Sequence[Signal], echoes: Sequence[Signal], report: Report
) -> tuple[list[str], CoarseFit]:
    """Coarse fits of one effect after another, each kept if it explains more than chance would.

    Args:
        current: causes accepted so far.
        signals: effects in the order they are tried.
        echoes: effects that the first of them may be an echo of; the best of all comes first.
        report: told what is being done.
    """
    base = current.fit
    fitter = CoarseFitter(base)
    best = fitter.coarse_fit(base.effects, base.released, [base.point])
    kept: list[str] = []

    def tried(signal: Signal) -> CoarseFit | None:
        name = signal.cause.name
        report(f"trying {name} beside {len(current.causes) + len(kept)} others")
        begin = [_beside(best.point, s, name) for s in starts(base, signal, best.point.z)]
        found = reached(partial(fitter.coarse_fit, (*best.effects, name), base.released, begin))
        # Coloured residuals inflate what chance gains (QAIC; Lebreton et al., 1992).
        chance = POLICY.aic_penalty * signal.freedom * signal.variance_inflation
        return found if found and found.objective < best.objective - chance else None

    def led() -> tuple[str, CoarseFit] | None:
        found = [(s.cause.name, tried(s)) for s in (signals[0], *echoes)]
        able = [(name, fitted) for name, fitted in found if fitted]
        return min(able, key=lambda pair: pair[1].objective) if able else None

    first = led()
    if first:
        best, kept = first[1], [first[0]]
    for signal in signals[1:]:
        found = None if signal.cause.name in kept else tried(signal)
        if found:
            best, kept = found, [*kept, signal.cause.name]
    return kept, best


def _beside(point: Point, start: Point, name: str) -> Point:
    own = {path: v for path, v in start.effects.items() if path.split(".")[1] == name}
    return replace(point, effects={**point.effects, **own})


@dataclass(frozen=True)
class Substitute:
    """An effect that explains in place of a cause what this explains.

    Attributes:
        cause: the cause.
        name: the effect in its place.
        cost: by how much -2 log likelihood grows, in the linear model.
    """

    cause: str
    name: str
    cost: float


def substitutes(found: Explanation, shown: Screen) -> list[Substitute]:
    """The best effect in place of each cause in the linear model, closest first.

    Args:
        found: causes with their fit.
        shown: all other causes against it.
    """
    fit = found.fit.extrapolated
    projector = Projector(fit)
    others = [s for s in shown.signals if s.cause.is_effect and s.followed is not None]
    best: dict[tuple[str, str], float] = {}
    for cause in found.causes:
        if cause not in fit.effects:
            continue
        off = off_values(fit, cause)
        own = np.array([fit.names.index(path) for path in off])
        shift = np.array(list(off.values())) - fit.estimates[own]
        if not np.isfinite(shift).all():
            continue
        rest = np.setdiff1d(np.arange(len(fit.names)), own)
        hessian = projector.hessian
        inside = hessian[np.ix_(rest, rest)]
        across = hessian[np.ix_(rest, own)]
        along = np.linalg.solve(inside, across)
        # Half the increase of the objective is shift' (H_oo - H_or H_rr^-1 H_ro) shift.
        loss = float(shift @ (hessian[np.ix_(own, own)] - across.T @ along) @ shift)
        for s in others:
            assert s.followed is not None
            pull = hessian @ s.followed  # X'J, where no bound is in the way
            energy = s.projected + s.followed.T @ pull
            slope = pull[own].T @ shift - pull[rest].T @ along @ shift - s.score
            own_info = energy - pull[rest].T @ np.linalg.solve(inside, pull[rest])
            gain = float(slope @ np.linalg.solve(own_info, slope))
            key = (cause, s.cause.name)
            cost = (loss - gain) / s.variance_inflation
            best[key] = min(best.get(key, np.inf), cost)
    found_all = [Substitute(c, n, cost) for (c, n), cost in best.items()]
    return sorted(found_all, key=lambda s: s.cost)
