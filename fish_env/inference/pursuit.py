"""Many causes at once: chosen in the linear model, fitted together, kept where each is needed.

A contest of full fits for every cause takes longer with each cause that is already there. Once the
largest causes are known, the others are small, and the linear model of the screen tells how they
act together: causes are picked in it one after another, tried in coarse fits along a chain, and
fitted together once. Those that are not significant beside the others are dropped. Source: forward
selection in a linear model (orthogonal matching pursuit; Pati, Rezaiifar and Krishnaprasad, 1993).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.adequacy import beyond_plausible, implausible_estimates
from fish_env.inference.elimination import allowed_loss, insignificant
from fish_env.inference.estimate.again import to_search
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import FEWER_STEPS, Fit, fit, objective_at
from fish_env.inference.estimate.information import eliminated
from fish_env.inference.explanation import Explanation, in_steps_of, reached
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectName, listed
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import Screen, zoomed
from fish_env.inference.starts import linear_estimate, probed, starts
from fish_env.inference.switched_off import off_values


@dataclass(frozen=True, eq=False)
class Pick:
    """A cause chosen in the linear model.

    Attributes:
        signal: the cause at its best alternative.
        log_p: of what it explains beside the causes picked before it.
        size: (m,) multiple of each of its settings, estimated together with all other picks.
    """

    signal: Signal
    log_p: float
    size: FloatArray


def picked(
    projector: Projector, shown: Screen, most: int, relaxed_log_p: float = 0.0
) -> list[Pick]:
    """Effects that explain more each, beside those picked before, than chance would.

    Args:
        projector: of the fit that was screened.
        shown: all causes against it.
        most: effects to pick at most.
        relaxed_log_p: added to the log p-value that makes an effect significant.
    """
    candidates, whole, score = _system(projector, shown)
    info, left = whole, score
    chosen: list[tuple[Signal, slice, float]] = []
    while len(chosen) < most:
        taken = {s.cause.id for s, _, _ in chosen}
        tests = [
            (_log_p(left[part], info[part, part], s), i)
            for i, (s, part) in enumerate(candidates)
            if s.cause.id not in taken and _independent(info[part, part], s.projected)
        ]
        log_p, best = min(tests, default=(np.inf, -1))
        if log_p >= shown.threshold + relaxed_log_p:
            break
        signal, part = candidates[best]
        chosen.append((signal, part, log_p))
        # What the pick leaves of all others: one step of a block elimination.
        along = np.linalg.solve(info[part, part], info[part])
        left = left - along.T @ left[part]
        info = info - along.T @ info[part]
    return _sized(chosen, whole, score)


def _system(
    projector: Projector, shown: Screen
) -> tuple[list[tuple[Signal, slice]], FloatArray, FloatArray]:
    """Effects, each with its columns, and information (N, N) and score (N,) of all columns.

    Args:
        projector: of the fit that was screened.
        shown: all causes against it.
    """
    own = shown.only(lambda s: s.cause.is_effect and s.followed is not None)
    candidates = list(zip(own.signals, own.columns(), strict=True))
    none = np.zeros((len(projector.prior), 0))
    followed = np.hstack([none, *(np.asarray(s.followed) for s in own.signals)])
    pull = np.sqrt(projector.prior)[:, None] * followed
    whole = own.products + pull.T @ pull
    for signal, part in candidates:
        whole[part, part] = signal.projected
    return candidates, whole, np.concatenate([np.zeros(0), *(s.score for s in own.signals)])


def _log_p(score: FloatArray, info: FloatArray, signal: Signal) -> float:
    statistic = float(score @ np.linalg.solve(info, score)) / signal.variance_inflation
    return signal.log_p_of(statistic)


def _sized(
    chosen: Sequence[tuple[Signal, slice, float]], whole: FloatArray, score: FloatArray
) -> list[Pick]:
    """Picks with the sizes that all of them together have.

    Args:
        chosen: signal, its columns, and log p-value of each pick.
        whole: (N, N) information about all columns.
        score: (N,) of all columns.
    """
    if not chosen:
        return []
    at = np.concatenate([np.arange(part.start, part.stop) for _, part, _ in chosen])
    info = whole[np.ix_(at, at)]
    sizes = np.linalg.solve(info + 1e-9 * np.diag(np.diag(info)), score[at])
    ends = np.cumsum([signal.freedom for signal, _, _ in chosen])[:-1]
    parts = np.split(sizes, ends)
    return [Pick(s, log_p, size) for (s, _, log_p), size in zip(chosen, parts, strict=True)]


def _independent(info: FloatArray, whole: FloatArray) -> bool:
    """Whether something of an effect is left beside those picked."""
    return bool(np.all(np.diag(info) > POLICY.least_independent_share * np.diag(whole)))


def pursued(
    current: Explanation,
    shown: Screen,
    report: Report,
    relaxed_log_p: float = 0.0,
    most: int = POLICY.most_causes,
    fewest: int = 1,
) -> Explanation:
    """The explanation with all causes that show beside it and are needed; itself without such.

    Args:
        current: causes accepted so far.
        shown: all causes against it.
        report: told what is being done.
        relaxed_log_p: added to the log p-value that makes a cause significant.
        most: further causes.
        fewest: causes that have to show; two where one alone was of no use.
    """
    room = min(most, POLICY.most_causes - len(current.causes))
    picks = picked(Projector(current.fit), shown, room, relaxed_log_p)
    if len(picks) < fewest:
        return current
    for causes in _led([pick.signal.cause.effect for pick in picks], current, shown, report):
        found = _needed(current, causes, picks, shown, report)
        if found is not current:
            return found
    return current


def _needed(
    current: Explanation,
    causes: Sequence[EffectName],
    picks: Sequence[Pick],
    shown: Screen,
    report: Report,
) -> Explanation:
    """The explanation with those of further causes that are needed; itself without such."""
    report(f"fitting {', '.join(causes)} together")
    coarse = _together(current, causes, picks, shown)
    if coarse is None:
        return current
    problem = to_search(current.fit.problem, coarse)
    same = in_steps_of(problem, current)
    for fitted in _fitted(problem, current, coarse, same.fit.objective):
        found = Explanation((*current.causes, *causes), fitted)
        # Beside so many others an effect of implausible size stands in for something else.
        wild: list[CauseId] = [name for name in causes if beyond_plausible(fitted, name)]
        sober = [name for name in found.causes if name not in wild]
        idle = (*wild, *insignificant(fitted, sober, shown.threshold))
        if set(causes) - set(idle):
            break
    else:
        return current
    report(f"fitting without {listed(idle)}" if idle else "fitting run-to-run variation")
    whole, found = found, found.varied(beside_misfit=True, dropped=idle)
    level = float(np.exp(shown.threshold))
    foreseen = sum((allowed_loss(fitted, cause, level) for cause in idle), 0.0)
    if set(idle) - set(wild) and found.score > whole.score + POLICY.evidence_doubt + foreseen:
        # The linear model does not hold as far as the values at which they are off.
        report(f"fitting again with {listed(name for name in idle if name not in wild)}")
        found = whole.varied(beside_misfit=True, dropped=wild)
    if found.score < same.score - POLICY.evidence_doubt and not implausible_estimates(found.fit):
        return found
    # Long steps may get more wrong than what is missing does.
    return same if same.score < current.score - POLICY.evidence_doubt else current


def _confusable(current: Explanation, cause: CauseId) -> tuple[str, ...]:
    known = current.fit.problem.known
    return () if isinstance(cause, Coefficient) else known[cause].confusable_with


def _fitted(
    problem: Problem, current: Explanation, coarse: CoarseFit, enough: float
) -> Iterator[Fit]:
    """Full fits from a coarse one, with the noise that they leave, that explain enough.

    What a coarse fit on a few runs makes of the parameters that were known before may be worse on
    all of them than they were, and so may the further effects. Then they begin where they hardly
    act, which may lead nowhere: a lag that long steps do not follow stays off. The next fit begins
    from the sizes of the coarse one all the same. One that explains less than there was without
    these effects has lost its way.

    Args:
        problem: the runs, in the steps of the fits.
        current: causes accepted so far.
        coarse: with further effects.
        enough: objective without these.
    """
    own = current.fit
    faint = Point(own.point.z, {**problem.beginning(coarse.effects), **own.point.effects})
    as_known = Point(own.point.z, {**coarse.point.effects, **own.point.effects})

    def left(point: Point) -> float:
        return objective_at(problem, coarse.effects, point, own.noise)

    best, second, _ = sorted((coarse.point, as_known, faint), key=left)
    for begin in (best, second) if best is faint else (best,):
        start = (coarse.effects, begin, own.noise, coarse.released)
        fitted = reached(
            partial(fit, problem, *start, rounds=2, iterations=FEWER_STEPS, give_up_above=enough)
        )
        if fitted is not None and fitted.objective < enough:
            yield fitted


def _led(
    names: list[EffectName], current: Explanation, shown: Screen, report: Report
) -> list[list[EffectName]]:
    """Names of effects, before the first of them what may show as it does if that is better.

    Two delays in a row are nearly one: the second shows no more, and what shows is its echo. An
    echo is left out; what is like the causes found, and not like the first, comes beside it. Where
    coarse fits hardly tell the two best apart, the second follows in case the first is of no use.
    """
    alike = {n for c in (*current.causes, names[0]) for n in _confusable(current, c)} - {*names}
    echoes = [s for s in shown.best() if s.cause.id in alike][: POLICY.most_echoes]
    if not echoes:
        return [names]
    base = current.fit
    fitter = CoarseFitter(base)
    tried: list[tuple[float, EffectName]] = []
    for signal in (*echoes, *(s for s in shown.best() if s.cause.id == names[0])):
        name = signal.cause.effect
        report(f"trying {name} beside {listed(current.causes)}")
        effects, begin = (*base.effects, name), starts(base, signal, base.point.z)
        found = reached(partial(fitter.coarse_fit, effects, base.released, begin))
        if found:
            tried.append((found.objective, name))
    enough = min(tried)[0] + POLICY.coarse_fit_leeway if tried else np.inf
    close = [name for objective, name in sorted(tried) if objective < enough]
    return [_in_place(name, names, current) for name in close[: POLICY.most_leads] or names[:1]]


def _in_place(
    best: EffectName, names: Sequence[EffectName], current: Explanation
) -> list[EffectName]:
    """The names behind the best, without the first of them if that is its echo."""
    echo = names[0] if best in _confusable(current, names[0]) else best
    return [best, *(name for name in names if name not in (best, echo))]


def _together(
    current: Explanation, causes: Sequence[EffectName], picks: Sequence[Pick], shown: Screen
) -> CoarseFit | None:
    """The coarse fit with all effects at once; None where the simulation diverges.

    It begins from their sizes in the linear model, from their mildest settings, or from where they
    hardly act: several at once, each of a size that shows, may be far worse than none.
    """
    base = current.fit
    sizes = {pick.signal.cause.effect: pick for pick in picks}
    signals = shown.by_effect()
    linear, mild = dict(base.point.effects), dict(base.point.effects)
    for name in causes:
        pick = sizes.get(name)
        closer = zoomed(base, pick.signal if pick else signals[name])
        if pick:
            # Sizes together hold for the alternative that was picked.
            size = pick.size if closer is pick.signal else closer.size
            linear |= linear_estimate(base, closer, size)
        mild |= probed(base.problem, closer)[0]
    faint = {**base.problem.beginning(causes), **base.point.effects}
    begin = [Point(base.point.z, values) for values in ({**mild, **linear}, mild, faint)]
    effects = (*base.effects, *causes)
    return reached(lambda: CoarseFitter(base).coarse_fit(effects, base.released, begin))


@dataclass(frozen=True)
class Substitute:
    """An effect that explains in place of a cause what this explains.

    Attributes:
        cause: the cause.
        name: the effect in its place.
        cost: by how much -2 log likelihood grows, in the linear model.
    """

    cause: EffectName
    name: EffectName
    cost: float


def substitutes(found: Explanation, shown: Screen) -> list[Substitute]:
    """The best effect in place of each cause in the linear model, closest first.

    Args:
        found: causes with their fit.
        shown: all other causes against it.
    """
    fit = found.fit
    projector = Projector(fit)
    others = [s for s in shown.signals if s.cause.is_effect and s.followed is not None]
    best: dict[tuple[EffectName, EffectName], float] = {}
    for cause in found.causes:
        if isinstance(cause, Coefficient):
            continue
        off = off_values(fit, cause)
        own = np.array([fit.ids.index(id) for id in off])
        shift = np.array(list(off.values())) - fit.estimates[own]
        hessian = projector.hessian
        rest, along, left = eliminated(hessian, own)
        loss = float(shift @ left @ shift)
        inside = hessian[np.ix_(rest, rest)]
        for s in others:
            assert s.followed is not None
            pull = hessian @ s.followed  # X'J, where no bound is in the way
            energy = s.projected + s.followed.T @ pull
            slope = pull[own].T @ shift - pull[rest].T @ along @ shift - s.score
            own_info = energy - pull[rest].T @ np.linalg.solve(inside, pull[rest])
            gain = float(slope @ np.linalg.solve(own_info, slope))
            key = (cause, s.cause.effect)
            cost = (loss - gain) / s.variance_inflation
            best[key] = min(best.get(key, np.inf), cost)
    found_all = [Substitute(c, n, cost) for (c, n), cost in best.items()]
    return sorted(found_all, key=lambda s: s.cost)
