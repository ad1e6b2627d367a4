"""Fits with other effects in the place of causes, with causes taken apart, or without some."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.hypotheses import (
    CauseId,
    Coefficient,
    EffectName,
    EffectParameterId,
    listed,
    name_of,
    of_effects,
)
from fish_env.inference.in_place import begun_without, replaced, without_causes
from fish_env.inference.limits import Values, parts_of
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.search import at_noise, is_off
from fish_env.inference.starts import baselines, probed
from fish_env.inference.switched_off import where_others_follow


def substituted(
    current: Explanation,
    pairs: Sequence[tuple[CauseId, Signal]],
    most: int,
    report: Report,
    beside_misfit: bool = False,
) -> list[Explanation]:
    """The explanation, and others with another effect in place of one of its causes, best first.

    A cause is chosen while others are still missing. A similar one may then win because it
    compensates for part of them. Beside a misfit so may what the runs differ in, which settles
    anew beside every effect.

    Args:
        current: causes with their fit.
        pairs: cause, and the effect to try in its place.
        most: how many to fit in full.
        report: told what is being done.
        beside_misfit: whether much is still unknown.
    """
    own = current.fit
    fitter = CoarseFitter(own)
    leeway = dict.fromkeys((name for name, _ in pairs), POLICY.coarse_fit_leeway)
    if beside_misfit:
        leeway = {name: max(least, what_may_lack(fitter, name)) for name, least in leeway.items()}
    found: list[tuple[float, tuple[CauseId, ...], CoarseFit]] = []
    for name, signal in pairs:
        report(f"trying {signal.cause.effect} instead of {name_of(name)}")
        causes = current.causes_with(signal.cause.id, name)
        enough = fitter.base + leeway[name]
        coarse = swapped(fitter, own, name, signal, enough)
        if coarse is None or coarse.objective >= enough:
            continue
        if not _stands_for(own.problem, signal.cause.effect, coarse.point.effects, current.causes):
            found.append((coarse.objective, causes, coarse))
    others = []
    # Beside a misfit the numbers of the runs have not settled yet, and no fit is hopeless.
    give_up_above = np.inf if beside_misfit else own.objective + POLICY.out_of_reach
    for _, causes, coarse in sorted(found, key=lambda f: f[0])[:most]:
        report(f"fitting {listed(causes, ' and ')}")
        fitted = at_noise(own.problem, coarse, own.noise, 4, give_up_above)
        if fitted is not None:
            others.append(Explanation(causes, fitted))
    found_all = [current, *others]
    if beside_misfit and others:
        report("fitting run-to-run variation")
        found_all = side_by_side([e.varied_to_the_end for e in found_all])
    return sorted(found_all, key=lambda e: e.score)


def what_may_lack(fitter: CoarseFitter, name: CauseId) -> float:
    """The part of what a cause explains in a coarse fit that a finalist may lack."""
    left = coarse_without(fitter, name)
    return np.inf if left is None else POLICY.coarse_fit_behind * (left.objective - fitter.base)


def swapped(
    fitter: CoarseFitter, own: Fit, name: CauseId, signal: Signal, enough: float
) -> CoarseFit | None:
    """The coarse fit with one effect in place of another, from all its sizes.

    It is given up where it will not get below ``enough``. One that ends switched off had begun too
    far away, and is tried from each size in turn.
    """
    effects, kept = replaced(own, name, signal.cause.effect)
    sizes = probed(own.problem, signal, every=True)
    begin = [Point(z, {**kept, **values}) for z in baselines(own) for values in sizes]
    trying = partial(fitter.coarse_fit, effects, own.released, give_up_above=enough)
    coarse = [reached(partial(trying, begin))]
    if coarse[0] is None or is_off(own.problem, coarse[0].point, signal.cause.effect):
        turns = fitter.promising(effects, own.released, begin, POLICY.most_turned_sizes)
        coarse += [reached(partial(trying, [b])) for b in turns]
    return min((s for s in coarse if s), key=lambda s: s.objective, default=None)


def in_parts(current: Explanation, cause: CauseId, report: Report) -> Explanation | None:
    """The explanation with effects that together do nearly what one of its causes does.

    In the place of two effects, one that is neither may fit best alone.

    Args:
        current: causes with their fit.
        cause: the one to take apart.
        report: told what is being done.

    Returns:
        None where nothing does the same together, or the simulation diverges.
    """
    own = current.fit
    if isinstance(cause, Coefficient) or cause not in own.effects:
        return None
    parts = parts_of(own.problem, cause, own.point.effects)
    if not parts:
        return None
    report(f"fitting {' and '.join(parts)} instead of {cause}")
    names = [EffectName(name) for name in parts]
    causes = tuple(dict.fromkeys(n for c in current.causes for n in (names if c == cause else [c])))
    effects = tuple(dict.fromkeys(n for e in own.effects for n in (names if e == cause else [e])))
    values = of_effects(own.point.effects, {*own.effects} - {cause})
    values |= {EffectParameterId(e, p): v for e, of in parts.items() for p, v in of.items()}
    start = (effects, Point(own.point.z, values), own.noise, own.released)
    enough = _enough(current, (cause,), POLICY.evidence_doubt)
    further = partial(fit, refit_noise=False, iterations=4, give_up_above=enough)
    fitted = reached(partial(further, own.problem, *start))
    return None if fitted is None else Explanation(causes, fitted)


def _stands_for(
    problem: Problem, effect: EffectName, values: Values, causes: Collection[CauseId]
) -> bool:
    """Whether an effect acts as others do together, of which some but not all are causes.

    What it adds to those would have shown as the others. Beside its limit either could be done
    without. In the place of all of them, one effect is the simpler explanation.
    """
    parts = {*parts_of(problem, effect, values)}
    there = parts & {*causes}
    return bool(there) and (len(parts) == 1 or there != parts)


def without(
    current: Explanation, dropped: Collection[CauseId], least: float = np.inf
) -> Explanation | None:
    """The fit when some of its causes are dropped, under the same noise model.

    None where the simulation diverges without them.

    Args:
        current: all causes.
        dropped: those to drop.
        least: growth of the score from which the fit is of no use, and may stop early.
    """
    return _smaller(current, dropped, False, least)


def without_in_step(current: Explanation, dropped: Collection[CauseId]) -> Explanation | None:
    """The fit without causes that are known not to be needed, the runs' numbers in their place.

    :func:`without` asks whether a cause is needed, and begins out of step without a rate.

    Args:
        current: all causes.
        dropped: those to drop.
    """
    return _smaller(current, dropped, True, np.inf)


def _smaller(
    current: Explanation, dropped: Collection[CauseId], keep_in_step: bool, least: float
) -> Explanation | None:
    own, enough = current.fit, _enough(current, dropped, least)

    def fitted() -> Fit:
        runs, begin = begun_without(own, dropped, keep_in_step)
        return fit(
            runs, begin.effects, begin.point, own.noise, begin.released,
            refit_noise=False, iterations=4, give_up_above=enough,
        )  # fmt: skip

    smaller = reached(fitted)
    if smaller is None:
        return None
    return Explanation(tuple(c for c in current.causes if c not in dropped), smaller)


def _enough(current: Explanation, dropped: Collection[CauseId], least: float) -> float:
    """Objective above which a fit without causes is of no use.

    The log determinant of all estimates changes too as they move without a cause.

    Args:
        current: all causes.
        dropped: those that it goes without.
        least: growth of the score from which it is of no use.
    """
    doubt = current.narrowed_by(dropped) + POLICY.linear_doubt
    return current.fit.objective + least + doubt


def coarse_without(
    fitter: CoarseFitter, cause: CauseId, give_up_above: float = np.inf
) -> CoarseFit | None:
    """The coarse fit without one of the causes; None where the simulation diverges without it.

    Args:
        fitter: of the fit with all causes.
        cause: the cause.
        give_up_above: stop early where the objective will not get below this.
    """
    begin = without_causes(fitter.fit, (cause,))
    points = [begin.point, where_others_follow(fitter.fit, begin)]
    trying = partial(fitter.coarse_fit, begin.effects, begin.released, points)
    return reached(partial(trying, give_up_above))
