"""Fits with one more cause: a coarse fit of each candidate, a full fit of the few that lead."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.effort import FULL, Effort
from fish_env.inference.estimate.again import search_steps, to_search, under_noise
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.explanation import Explanation, fitted_again, reached
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectParameterId, name_of
from fish_env.inference.limits import does_no_more
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.starts import starts

NamedCoarseFit = tuple[CauseId, CoarseFit]
"""With the cause that it has added."""
Way = Callable[[float, Signal], list[NamedCoarseFit]]
"""Coarse fits of a cause, given up where they will not get below an objective."""


def refits(
    current: Explanation,
    chosen: Sequence[Signal],
    report: Report,
    relaxed: tuple[Fit, Sequence[Signal]] | None = None,
    effort: Effort = FULL,
    like: Callable[[CauseId], Sequence[Signal]] = lambda cause: (),
    unseen: Sequence[Signal] = (),
) -> tuple[list[Explanation], Explanation | None]:
    """Fits with one more cause each, best first, and the present one under the best one's noise.

    All share the noise model that the best of them leaves, whose disturbance is the smallest: fits
    can be compared only under one noise model.

    Args:
        current: causes accepted so far.
        chosen: causes to add.
        report: told what is being done.
        relaxed: fit under relaxed noise, and the effects that it shows.
        effort: how many causes to try beside the chosen ones, and to fit in full.
        like: further causes known to look like one, which are tried if it leads.
        unseen: causes to add that may hide from the screen.
    """
    if not chosen:
        return [], None
    base = current.fit
    fitter = CoarseFitter(base)
    under_relaxed, shown = relaxed or (base, ())
    follower = CoarseFitter(under_relaxed)

    def followed(enough: float, signal: Signal) -> list[NamedCoarseFit]:
        report(f"trying {name_of(signal.cause.id)} under relaxed noise")
        first = _coarse_fits(follower, base, signal, starts(under_relaxed, signal))
        return [s for _, f in first for s in _coarse_fits(fitter, base, signal, [f.point], enough)]

    def alone(enough: float, signal: Signal) -> list[NamedCoarseFit]:
        report(f"trying {name_of(signal.cause.id)}")
        return _coarse_fits(fitter, base, signal, starts(base, signal), enough)

    def also(way: Way, signals: Sequence[Signal]) -> list[NamedCoarseFit]:
        enough = _enough(coarse, fitter.base, POLICY.coarse_fit_behind, effort.finalists)
        return _all([partial(way, enough, signal) for signal in signals])

    coarse: list[NamedCoarseFit] = []
    for way, signals in ((alone, chosen), (followed, shown), (alone, unseen)):
        coarse += also(way, signals)
    if coarse:
        ahead = min(coarse, key=lambda s: s[1].objective)[0]
        coarse += also(alone, like(ahead)[: effort.shortlist])
    settled = bool(current.causes) and not disturbance_at_limit(base)
    if settled:
        coarse = _improving(fitter, coarse, {signal.cause.id for signal in chosen})
    finalists = _finalists(coarse, fitter.base, POLICY.coarse_fit_behind, effort.finalists)
    found = (_gaining if settled else _led)(current, finalists, report)
    if not found:
        return [], None
    tried, noise = _best_first(found, None if settled else found[0])
    return tried, _under(current, noise, tried[0].fit.objective)


def _under(current: Explanation, noise: Any, best: float) -> Explanation:
    """The present explanation under the noise that the best one leaves, as far as it comes near.

    Where it diverges under the smaller disturbance, it keeps the one that suits it.
    """
    own = current.fit
    again = at_noise(own.problem, own, noise, 2, best + POLICY.out_of_reach)
    return Explanation(current.causes, again or own)


def _all(tasks: Iterable[Callable[[], list[NamedCoarseFit]]]) -> list[NamedCoarseFit]:
    return [named for found in side_by_side(tasks) for named in found]


def restart_from_winner(
    current: Explanation, tried: list[Explanation], chosen: Sequence[Signal], report: Report
) -> list[Explanation]:
    """Restart the other causes from the winner's coefficients and disturbance.

    Those of the first contest began from the baseline's, which the misfit had biased. The ones of
    a good explanation are near those of a better one.

    Args:
        current: causes accepted before.
        tried: result of :func:`refits`, best first.
        chosen: causes to put in the winner's place.
        report: told what is being done.
    """
    best = tried[0].fit
    fitter = CoarseFitter(best)
    enough = fitter.base + POLICY.coarse_fit_leeway
    done = {e.causes[-1] for e in tried}

    def again(signal: Signal) -> list[NamedCoarseFit]:
        report(f"trying {name_of(signal.cause.id)} again")
        begin = starts(current.fit, signal, best.point.z)
        return _coarse_fits(fitter, current.fit, signal, begin, enough)

    others = [s for s in chosen if s.cause.is_effect and s.cause.id not in done]
    coarse = _all(partial(again, s) for s in others)
    finalists = _finalists(coarse, fitter.base, 0.0, FULL.finalists)
    finalists = [f for f in finalists if f[1].objective < enough]
    finalists = _that_do_more(best.problem, tried[0].causes[-1], fitter.base, finalists)
    more = _rest(current, finalists, best, report)
    return _best_first([*tried, *more], tried[0])[0]


def _coarse_fits(
    fitter: CoarseFitter,
    base: Fit,
    signal: Signal,
    begin: Sequence[Point],
    give_up_above: float = np.inf,
) -> list[NamedCoarseFit]:
    """The coarse fit of one cause; none where the simulation diverges from every start.

    Where the few runs of a coarse fit show nothing of an effect it may end switched off. The
    estimate from all runs, the first start, is then the better start of a full fit.
    """
    cause = signal.cause
    effects, released = base.effects, base.released
    if isinstance(cause.id, Coefficient):
        released = (*released, cause.id)
    else:
        effects = (*effects, cause.id)
    found = reached(lambda: fitter.coarse_fit(effects, released, begin, give_up_above))
    if found is None:
        return []
    if cause.is_effect and is_off(base.problem, found.point, cause.effect):
        found = replace(found, point=begin[0])
    return [(cause.id, found)]


def is_off(problem: Problem, point: Point, name: str) -> bool:
    """Whether an effect does nothing at a point."""
    switching = problem.known[name].switching
    return all(point.effects[EffectParameterId(name, p.name)] == p.neutral for p in switching)


def _finalists(
    coarse: list[NamedCoarseFit], base: float, behind: float, most: int
) -> list[NamedCoarseFit]:
    """Coarse fits that may still lead to the best fit, best first."""
    if not coarse:
        return []
    ranked = sorted(coarse, key=lambda s: s[1].objective)
    first = {name: i for i, (name, _) in reversed(list(enumerate(ranked)))}
    ranked = [ranked[i] for i in sorted(first.values())]  # a cause may have several
    enough = _enough(ranked, base, behind, most)
    return [s for s in ranked[:most] if s[1].objective <= enough]


def _enough(coarse: list[NamedCoarseFit], base: float, behind: float, most: int) -> float:
    """Objective up to which a coarse fit may be a finalist, however far others will yet get."""
    best = min((s.objective for _, s in coarse), default=np.inf)
    return best if most == 1 else best + max(POLICY.coarse_fit_leeway, behind * (base - best))


def _improving(
    fitter: CoarseFitter, coarse: list[NamedCoarseFit], seen: Collection[CauseId]
) -> list[NamedCoarseFit]:
    """Coarse fits of significant causes, and of others that gain more than the AIC penalty."""
    if all(name in seen for name, _ in coarse):
        return coarse
    own = fitter.fit
    alone = fitter.coarse_fit(own.effects, own.released, [own.point])
    enough = alone.objective - POLICY.aic_penalty
    return [(name, s) for name, s in coarse if name in seen or s.objective < enough]


def _led(
    current: Explanation, finalists: list[NamedCoarseFit], report: Report
) -> list[Explanation]:
    """Full fits under the noise that the likeliest of them leaves, which comes first."""
    base, left = current.fit, [*finalists]
    while left:
        name, coarse = left.pop(0)
        report(f"fitting {name_of(name)}")
        leader = in_full(base.problem, coarse, base.noise)
        if leader is not None:
            first = Explanation((*current.causes, name), leader)
            left = _that_do_more(base.problem, name, coarse.objective, left)
            return [first, *_rest(current, left, leader, report)]
    return []


def _that_do_more(
    problem: Problem, leading: CauseId, objective: float, finalists: list[NamedCoarseFit]
) -> list[NamedCoarseFit]:
    """The finalists without those that do no more than the leading cause, see :func:`does_no_more`.

    Args:
        problem: knows the effects.
        leading: the leading cause.
        objective: that its coarse fit reaches.
        finalists: other coarse fits.
    """
    return [
        (name, coarse)
        for name, coarse in finalists
        if isinstance(name, Coefficient)
        or coarse.objective < objective
        or not does_no_more(problem, name, coarse.point.effects, leading)
    ]


def _gaining(
    current: Explanation, finalists: list[NamedCoarseFit], report: Report
) -> list[Explanation]:
    """Full fits under the present noise; none of them where none explains more than there is.

    Where no misfit drives the disturbance, one more cause hardly changes it: its model will do to
    see whether what showed was chance.
    """
    found = _rest(current, finalists, current.fit, report)
    return found if any(e.score < current.score for e in found) else []


def _rest(
    current: Explanation, finalists: list[NamedCoarseFit], leader: Fit, report: Report
) -> list[Explanation]:
    """Full fits under the leader's noise, as far as they may come near the leader's."""
    give_up_above = leader.objective + POLICY.out_of_reach

    def fitted(name: CauseId, coarse: CoarseFit) -> Explanation | None:
        report(f"fitting {name_of(name)}")
        found = at_noise(leader.problem, coarse, leader.noise, 4, give_up_above)
        return None if found is None else Explanation((*current.causes, name), found)

    tasks = [partial(fitted, name, coarse) for name, coarse in finalists]
    return [explanation for explanation in side_by_side(tasks) if explanation]


def _best_first(
    tried: list[Explanation], leader: Explanation | None
) -> tuple[list[Explanation], Any]:
    """Explanations by score, the first with the noise it leaves, and the others under that.

    Args:
        tried: explanations under one noise model.
        leader: the one that has left it, if one of them has.
    """
    ranked = sorted(tried, key=lambda e: e.score)
    own = ranked[0].fit
    problem = own.problem
    first = None if ranked[0] is leader else _noise_too(problem, own)
    if first is None:
        return ranked, own.noise
    beyond = first.objective + POLICY.out_of_reach
    tasks = [partial(at_noise, problem, e.fit, first.noise, 2, beyond) for e in ranked[1:]]
    pairs = zip(ranked[1:], side_by_side(tasks), strict=True)
    others = [Explanation(e.causes, fitted) for e, fitted in pairs if fitted]
    return [Explanation(ranked[0].causes, first), *others], first.noise


def in_full(problem: Problem, coarse: CoarseFit, noise: Any) -> Fit | None:
    """The full fit from a coarse one, first on a few runs; None where the simulation diverges.

    Where each run has a drive of its own, in the steps of a search.
    """
    problem = to_search(problem, coarse)
    few = problem.subset(POLICY.few_runs)
    # The noise of the sensors is told in a second round only.
    rounds = 2 if few is problem else 1
    start = (coarse.effects, coarse.point, noise, coarse.released)
    steps = search_steps(problem)
    first = reached(lambda: fit(few, *start, rounds=rounds, iterations=steps))
    return first if first is None or few is problem else _noise_too(problem, first)


def at_noise(
    problem: Problem,
    at: CoarseFit | Fit,
    noise: Any,
    iterations: int,
    give_up_above: float = np.inf,
) -> Fit | None:
    """As :func:`under_noise`; None where the simulation diverges."""
    return reached(partial(under_noise, problem, at, noise, iterations, give_up_above))


def _noise_too(problem: Problem, own: Fit) -> Fit | None:
    return fitted_again(problem, own, own.noise)
