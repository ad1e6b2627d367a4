"""Where a fit begins that has a look-alike, or nothing, in the place of one of its causes.

What all runs have in common of a beat may be in an effect, or in the numbers of every run. A swap
that changes the one and keeps the other begins out of step, from where no whole step leads back.
So the numbers take on what a cause leaves behind, and give up what a look-alike brings.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import Fit, objective_at
from fish_env.inference.estimate.free import spread_of
from fish_env.inference.hypotheses import (
    CauseId,
    EffectName,
    EffectParameterId,
    effects_of,
    of_effects,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.projection import Signal
from fish_env.inference.starts import probed
from fish_env.inference.switched_off import where_others_follow


def with_lookalike(own: Fit, cause: CauseId, signal: Signal) -> CoarseFit:
    """Where a fit begins that has a look-alike in the place of a cause.

    As it was measured; else where the two have parameters of the same name, at the values of the
    cause; else at its mildest.

    Args:
        own: fit with the cause.
        cause: an effect.
        signal: of the look-alike.
    """
    values, measured = own.point.effects, own.problem.drive.in_step
    effects, kept = replaced(own, cause, signal.cause.effect)
    (first, *_) = probed(own.problem, signal)
    begin = {
        id: value if id in measured else values.get(EffectParameterId(str(cause), id.name), value)
        for id, value in first.items()
    }
    return CoarseFit(effects, own.released, Point(own.point.z, {**kept, **begin}), np.inf)


def replaced(
    own: Fit, cause: CauseId, name: EffectName
) -> tuple[tuple[str, ...], dict[EffectParameterId, float]]:
    """Effects of a fit with another one in the place of a cause, and the values that it keeps.

    Args:
        own: fit with the cause.
        cause: an effect.
        name: of the other.
    """
    effects = tuple(name if e == cause else e for e in own.effects)
    return effects, of_effects(own.point.effects, {*own.effects} - {cause})


def without_causes(own: Fit, dropped: Collection[CauseId]) -> CoarseFit:
    """Where a fit begins without some of its causes.

    Args:
        own: fit with the causes.
        dropped: the causes.
    """
    effects = tuple(e for e in own.effects if e not in dropped)
    released = tuple(c for c in own.released if c not in dropped)
    point = Point(own.point.z, of_effects(own.point.effects, effects))
    return CoarseFit(effects, released, point, np.inf)


def begun_without(
    own: Fit, dropped: Collection[CauseId], keep_in_step: bool
) -> tuple[Problem, CoarseFit]:
    """The runs of a fit, and where a fit to them begins without some of its causes.

    The others begin where the linear model leads, if that is better than where they are. What it
    says of others is not used where numbers of runs take on what a cause leaves.

    Args:
        own: fit with the causes.
        dropped: the causes.
        keep_in_step: whether numbers of runs do that.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    begin = without_causes(own, dropped)
    runs = in_step_without(own, dropped, begin) if keep_in_step else own.problem
    if runs is not own.problem:
        return runs, begin
    points = [begin.point, where_others_follow(own, begin)]
    start = [(begin.effects, point, own.noise, begin.released) for point in points]
    values = [objective_at(runs, *one) for one in start]
    return runs, replace(begin, point=points[int(np.argmin(values))])


def in_step(runs: Problem, own: Fit, cause: CauseId, at: CoarseFit) -> Problem:
    """Runs with numbers that keep them in step without a cause.

    Args:
        runs: some of those of a fit, with its numbers.
        own: fit with the cause.
        cause: an effect.
        at: where a fit begins without it, perhaps with a look-alike.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    gained = _gained_by_runs(own, cause, at)
    if not gained.any():
        return runs
    return runs.with_variation(runs.variation + gained, at.point, own.noise)


def in_step_without(own: Fit, dropped: Collection[CauseId], begin: CoarseFit) -> Problem:
    """The runs of a fit with numbers that keep them in step without some of its causes.

    Args:
        own: fit with the causes.
        dropped: the causes.
        begin: where a fit begins without them.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    runs = own.problem
    for cause in dropped:
        if moved_to_runs(own, cause):
            runs = in_step(runs, own, cause, begin)
    return runs


def moved_to_runs(own: Fit, cause: CauseId) -> bool:
    """Whether numbers of the runs may take on what they have of a cause in common.

    Args:
        own: fit with the cause.
        cause: an effect.
    """
    return cause in own.effects and bool(_of_step(own))


def surprising_runs(fitted: Fit, cause: CauseId) -> bool:
    """Whether runs would have to differ by more than ordinary ones in what took a cause's place.

    Args:
        fitted: fit without the cause.
        cause: an effect.
    """
    alike = _alike(fitted.problem, cause)
    spread = spread_of(fitted.problem, fitted.noise)
    for number, beside in _of_step(fitted).items():
        if beside.effect in alike:
            own = fitted.problem.variation[:, number] / spread[number]
            if chdtrc(len(own), own @ own) < POLICY.surprising_runs_level:
                return True
    return False


def _gained_by_runs(own: Fit, cause: CauseId, at: CoarseFit) -> FloatArray:
    """What the number of each run (K,) gains: what a cause leaves, less what a look-alike brings.

    Parameters that have the same name do the same to a run, of effects that look alike.
    """
    new = of_effects(at.point.effects, {*at.effects} - {*own.effects})
    alike = _alike(own.problem, cause) | {*effects_of(new)}
    gained = np.zeros(len(own.problem.variations))
    for number, beside in _of_step(own).items():
        if beside.effect in alike:
            neutral = own.problem.neutral([beside.effect])[beside]
            before = own.point.effects.get(EffectParameterId(str(cause), beside.name), neutral)
            after = [value for id, value in new.items() if id.name == beside.name]
            gained[number] = before - (after[0] if after else neutral)
    return gained


def _alike(problem: Problem, cause: CauseId) -> set[str]:
    """An effect, and those that look like it."""
    return {str(cause), *problem.known[EffectName(str(cause))].confusable_with}


def _of_step(own: Fit) -> dict[int, EffectParameterId]:
    """Numbers that put single runs out of step, each with the parameter that does so in all."""
    spread = spread_of(own.problem, own.noise).tolist()
    return {
        i: v.beside
        for i, (v, sd) in enumerate(zip(own.problem.variations, spread, strict=True))
        if sd > 0.0 and v.beside is not None and v.beside.effect in own.problem.out_of_step
    }
