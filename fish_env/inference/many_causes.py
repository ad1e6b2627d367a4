"""All further causes at once, beside those that were found one at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.explanation import Explanation, exchanged
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectName
from fish_env.inference.limits import limit_at, limit_of
from fish_env.inference.lookalikes import late, pairs_alike
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause
from fish_env.inference.problem import Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.pursuit import pursued, substitutes
from fish_env.inference.rivals import ranked, rivals_of
from fish_env.inference.screening import Screen, screen
from fish_env.inference.shortlist import shortlisted
from fish_env.inference.starts import probed
from fish_env.inference.substitution import in_parts, substituted, without
from fish_env.inference.trials import tried_out


def pursue(
    current: Explanation,
    shown: Screen,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    report: Report,
    relaxed_log_p: float,
) -> tuple[Explanation, Screen, list[tuple[CauseId, CauseId]]]:
    """The explanation with all further causes that are needed together, and its screen.

    Beside a misfit too with what the runs differ in: else a cause stands in for that.

    Args:
        current: causes found one at a time.
        shown: all causes against it.
        causes: causes to consider.
        rng: for null distributions.
        report: told what is being done.
        relaxed_log_p: added to the log p-value that makes a cause significant.

    Returns:
        The explanation, its screen, and causes that took the place of another effect on the way,
        each with that effect.
    """
    if not shortlisted(current.fit.problem, shown, 1, relaxed_log_p):
        return current, shown, []
    pursuit = Pursuit(causes, rng, report, relaxed_log_p)
    first = current.causes
    current, shown = pursuit.simplified(current, shown)
    if disturbance_at_limit(current.fit):
        varied = current.varied(beside_misfit=True)
        if varied.score < current.score - POLICY.evidence_doubt:
            current, shown = varied, pursuit.screened(varied)
    current, shown, replaced, none_alone = pursuit.one_at_a_time(current, shown)
    current, shown = pursuit.many_at_a_time(current, shown, first, 2 if none_alone else 1)
    return current, shown, replaced


@dataclass(frozen=True, eq=False)
class Pursuit:
    """How further causes are found; the attributes are arguments of :func:`pursue`."""

    causes: Sequence[Cause]
    rng: np.random.Generator
    report: Report
    relaxed_log_p: float

    def screened(self, current: Explanation) -> Screen:
        """All causes against an explanation."""
        return screen(current.fit, self.causes, self.rng)

    def one_at_a_time(
        self, current: Explanation, shown: Screen
    ) -> tuple[Explanation, Screen, list[tuple[CauseId, CauseId]], bool]:
        """Causes beside a disturbance of implausible strength, while there is one.

        Returns:
            The explanation, its screen, causes that took the place of another effect, each with
            that effect, and whether at last no cause alone was of use.
        """
        replaced: list[tuple[CauseId, CauseId]] = []
        hidden = True
        for _ in range(POLICY.most_single_searches):
            if not disturbance_at_limit(current.fit) or not current.fit.problem.work.allows_more():
                break
            more = tried_out(current, beside(current, shown), self.report) if hidden else None
            # Where none shows from the fit itself, none will beside one cause more.
            hidden = more is not None or current.fit.problem.swamped(current.fit.noise)
            more = more or self._pursued(current, shown, most=1)
            if more is current:
                return current, shown, replaced, True
            more, shown = self.simplified(more, self.screened(more))
            current = _against_likes(more, shown, self.report)
            if current is not more:
                replaced += exchanged(current, more)
                shown = self.screened(current)
        return current, shown, replaced, False

    def many_at_a_time(
        self, current: Explanation, shown: Screen, first: Sequence[CauseId], fewest: int
    ) -> tuple[Explanation, Screen]:
        """Causes that are needed together, as long as there are more.

        Args:
            current: causes found so far.
            shown: all causes against it.
            first: those of them that were found before the others.
            fewest: causes that have to show at first.
        """
        for _ in range(POLICY.pursuits):
            if not current.fit.problem.work.allows_more():
                break
            more = self._pursued(current, shown, fewest=fewest)
            if more is current:
                break
            fewest = 1
            current, shown = self.simplified(more, self.screened(more))
            if disturbance_at_limit(current.fit):
                # Much is still unknown, and what would be picked next stands in for it.
                return _told_apart(current, first, shown), shown
        return current, shown

    def _pursued(self, current: Explanation, shown: Screen, **limits: int) -> Explanation:
        kept = beside(current, shown)
        return pursued(current, kept, self.report, self.relaxed_log_p, **limits)

    def simplified(self, current: Explanation, shown: Screen) -> tuple[Explanation, Screen]:
        """The explanation, and its screen, with effects that act as a simpler one does replaced.

        What is found first makes up for part of what is missing. An effect that has another one as
        its limit is found in the other's place then, and comes near the limit as more is explained.
        """
        for cause in current.causes:
            if not limit_of(current.fit, cause):
                continue
            simpler = in_parts(current, cause, self.report)
            if simpler and simpler.score < current.score + POLICY.evidence_doubt:
                return simpler, self.screened(simpler)
        return current, shown


def _against_likes(current: Explanation, shown: Screen, report: Report) -> Explanation:
    """The explanation after effects known to look like its last cause were tried in its place.

    Beside a large misfit the linear model tells little. Fits do, once what the runs differ in has
    settled beside each effect.
    """
    *_, last = current.causes
    assert not isinstance(last, Coefficient)
    known = current.fit.problem.known[last].confusable_with
    signals = shown.by_effect()
    alike = [s for s in substitutes(current, shown) if s.cause == last and s.name in known]
    pairs = [(last, signals[s.name]) for s in alike[: POLICY.most_lookalikes]]
    return substituted(current, pairs, 1, report, beside_misfit=True)[0]


def beside(current: Explanation, shown: Screen) -> Screen:
    """The screen without causes that may only take the place of one that is there.

    Of an effect and its limit both are in doubt as soon as both are there: each can be done
    without. Where the beat of a drive was measured, what was measured is among the causes: a second
    clock or beat only trades with it.
    """
    own = current.fit
    problem = own.problem
    left_out: set[CauseId | None] = {limit_of(own, cause) for cause in current.causes}
    left_out |= {s.cause.id for s in shown.signals if _limit(problem, s) in current.causes}
    if problem.drive.effects and problem.drive.effects <= {*current.causes}:
        left_out |= {*problem.out_of_step}
    return shown.only(lambda signal: signal.cause.id not in left_out)


def _limit(problem: Problem, signal: Signal) -> EffectName | None:
    """The effect that a cause on trial has as its limit; None without one."""
    if not signal.cause.is_effect:
        return None
    return limit_at(problem, signal.cause.effect, probed(problem, signal)[0])


def _told_apart(current: Explanation, first: Sequence[CauseId], shown: Screen) -> Explanation:
    """The explanation without further causes that another effect explains as well.

    Not without those that much depends on: a fit without any of such look-alikes is of no use.

    Args:
        current: causes with their fit.
        first: those of them that were found one at a time.
        shown: all other causes against it.
    """
    close = {s.cause for s in substitutes(current, shown) if s.cost < POLICY.evidence_doubt}
    doubtful = close - {*first}
    smaller = without(current, doubtful, POLICY.out_of_reach) if doubtful else None
    if smaller is None or smaller.score > current.score + POLICY.out_of_reach:
        return current
    return smaller


def challenged(
    current: Explanation,
    shown: Screen,
    rivals: Sequence[Explanation],
    report: Report,
    replaced: Sequence[tuple[CauseId, CauseId]] = (),
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation after the effects closest to its causes were tried in their place.

    With those that explain the data alike. The closest to each cause come first: a small cause that
    many could replace must not keep the others from being doubted. Beside a disturbance of
    implausible strength no fit tells which is better, and none is made.

    Args:
        current: causes of which some were found together.
        shown: all other causes against it.
        rivals: explanations that were as good before the last causes were found.
        report: told what is being done.
        replaced: causes with the effects whose place they took then, also some that have been
            dropped since.
    """
    if disturbance_at_limit(current.fit):
        return current, ()
    # A coefficient takes no effect's place.
    effects = {*current.causes}.intersection(current.fit.problem.known)
    signals = shown.by_effect()
    close = _close(current, shown)
    earlier = [pair for e in rivals for pair in exchanged(current, e)]
    kinds = [*_of_drive(current), *late(current)]
    tried = [*replaced, *[*earlier, *each_in_turn(close)][: POLICY.most_substitutes]]
    # Where each run has a drive of its own, these are asked of estimates to be published.
    uneven = current.fit.problem.drive.uneven
    tried = [pair for pair in tried if pair not in kinds] if uneven else [*kinds, *tried]
    pairs = [(c, signals[n]) for c, n in dict.fromkeys(tried) if n in signals and c in effects]
    best, *others = substituted(current, pairs, POLICY.most_challenges, report)
    apart = [in_parts(best, cause, report) for cause in best.causes]
    best, *others = ranked([best, *others, *filter(None, apart)])
    return best, rivals_of(best, others)


def _close(current: Explanation, shown: Screen) -> list[tuple[EffectName, EffectName]]:
    """Causes, each with an effect that may be in its place; first those known to look like it.

    Of motion with corners the linear model tells little: there such an effect counts
    whatever it says.

    Args:
        current: causes with their fit.
        shown: all other causes against it.
    """
    problem = current.fit.problem
    alike: list[tuple[EffectName, EffectName]] = []
    others: list[tuple[EffectName, EffectName]] = []
    for s in substitutes(current, shown):
        is_alike = s.name in problem.known[s.cause].confusable_with
        if s.cost < POLICY.linear_doubt or (is_alike and problem.is_nonsmooth((s.cause, s.name))):
            (alike if is_alike else others).append((s.cause, s.name))
    return [*alike, *others]


def _of_drive(current: Explanation) -> list[tuple[EffectName, EffectName]]:
    """What was measured of a drive, with what else in the clocks or the drive may have shown it."""
    problem = current.fit.problem
    measured = [
        cause
        for cause in current.causes
        if not isinstance(cause, Coefficient) and cause in problem.drive.effects
    ]
    return pairs_alike(current, measured, problem.out_of_step)


def each_in_turn(
    close: Sequence[tuple[EffectName, EffectName]],
) -> list[tuple[EffectName, EffectName]]:
    """Pairs of a cause and a substitute: the first of each cause, then the second, and so on."""
    ranks: dict[EffectName, int] = {}
    ranked = []
    for cause, name in close:
        ranks[cause] = ranks.get(cause, -1) + 1
        ranked.append((ranks[cause], (cause, name)))
    return [pair for _, pair in sorted(ranked, key=lambda entry: entry[0])]
