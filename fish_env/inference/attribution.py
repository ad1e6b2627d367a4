"""Which causes explain the misfit: forward selection, then backward elimination."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import stdtrit

from fish_env.arrays import FloatArray
from fish_env.inference.adequacy import disturbance_at_limit, implausible_estimates
from fish_env.inference.effort import FULL, Effort
from fish_env.inference.elimination import backward_elimination
from fish_env.inference.estimate.fit import Fit, finished, with_run_variation
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.left_out import left_out_scores
from fish_env.inference.parallel import both
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause, same_causes
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import Screen, screen
from fish_env.inference.search import refits, restart_from_winner, swap_step


@dataclass(frozen=True)
class Ranked:
    """How much better one cause predicts runs than the baseline does.

    Attributes:
        name: the cause.
        score: log score of all runs, each left out in turn, above that of the baseline under the
            same noise.
        interval: 95 % interval of the score over runs like these.
    """

    name: str
    score: float
    interval: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Attribution:
    """Result of the search.

    Attributes:
        baseline: refitted baseline.
        screens: screen of the baseline, then of each accepted explanation.
        accepted: explanation of the last step (the baseline itself when nothing was added).
        rivals: explanations that fit as well as the accepted one.
        ranking: causes fitted in the first step, best first.
        gain: of all accepted causes together, in the same unit.
        failed: causes that were fitted beside the accepted ones and explained too little more.
    """

    baseline: Explanation
    screens: tuple[Screen, ...]
    accepted: Explanation
    rivals: tuple[Explanation, ...]
    ranking: tuple[Ranked, ...]
    gain: float
    failed: frozenset[str] = frozenset()

    @property
    def tolerated(self) -> float:
        """What the simulation of the accepted causes may get wrong itself, in the same unit."""
        return roughness(self.accepted) * self.gain

    def extrapolated(self) -> Attribution:
        """The same, with estimates as ever finer steps put them."""
        rivals = tuple(e.extrapolated() for e in self.rivals)
        return replace(self, accepted=self.accepted.extrapolated(), rivals=rivals)


def attribute(
    problem: Problem,
    baseline: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort = FULL,
    report: Callable[[str], None] = lambda step: None,
) -> Attribution:
    """Add causes while one is significant, keep all that explain the data alike.

    Args:
        problem: runs used for fitting.
        baseline: refitted baseline.
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told what is being done.
    """
    nothing = Explanation((), baseline)
    relax = effort.retries and disturbance_at_limit(baseline)
    first, _ = both(  # where the disturbance is at its limit, relaxed noise is tried in any case
        partial(screen, baseline, causes, rng),
        lambda: nothing.with_relaxed_noise if relax else None,
    )
    begun = Attribution(nothing, (first,), nothing, (), (), 0.0)
    return extended(begun, causes, rng, effort, report)


def extended(
    begun: Attribution,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort = FULL,
    report: Callable[[str], None] = lambda step: None,
    relaxed_log_p: float = 0.0,
) -> Attribution:
    """An attribution with more causes, if more are significant.

    Args:
        begun: what was found so far.
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told what is being done.
        relaxed_log_p: added to the log p-value that makes a cause significant, where the adequacy
            test says that something is missing.
    """
    problem = begun.baseline.fit.problem
    current, screens = begun.accepted, [*begun.screens]
    rivals, ranking = begun.rivals, begun.ranking
    total, rough = begun.gain, roughness(current)
    whole_effort, failed = effort, begun.failed
    while len(current.causes) < POLICY.most_causes and not any(tied(current, e) for e in rivals):
        effort = (
            whole_effort if len(current.causes) < POLICY.thorough_causes else whole_effort.reduced
        )
        found = len(current.fit.released)
        chosen = shortlisted(
            problem, screens[-1], effort.shortlist, rough * total, relaxed_log_p, found
        )
        chosen = [signal for signal in chosen if signal.cause.name not in failed]
        relatives: list[Signal] = []
        for name in current.causes if chosen and effort.retries else ():
            # A cause that resembles an accepted one may be absorbed by its estimates.
            relatives += _like(name, screens[-1], [*chosen, *relatives], problem)
        unseen = [*relatives, *_drifting(current, screens[-1], chosen)]
        relaxed = _under_relaxed_noise(current, chosen, causes, rng) if effort.retries else None
        like = partial(_like, before=screens[-1], chosen=[*chosen, *unseen], problem=problem)
        tried, base = refits(current, chosen, report, relaxed, effort, like, unseen)
        if base is None:
            break
        if current.causes and not implausible_estimates(current.fit):
            tried = [e for e in tried if not implausible_estimates(e.fit)]
            if not tried:
                failed |= {signal.cause.name for signal in chosen}
                break
        if not ranking:
            ranking = ranking_of(tried, base)
        gain = base.score - tried[0].score
        if gain < max(POLICY.evidence_doubt, rough * total):
            failed |= {signal.cause.name for signal in chosen}
            break
        total, failed = total + gain, frozenset()
        after = screen(tried[0].fit, causes, rng)
        rough = roughness(tried[0])
        if effort.retries and shortlisted(problem, after, 1, rough * total):
            others = [*chosen, *relatives]
            others += _new(after, others)
            others += _like(tried[0].causes[-1], screens[-1], others, problem)
            again = restart_from_winner(current, tried, others, report)
            if again[0] is not tried[0]:
                after = screen(again[0].fit, causes, rng)
            tried = again
        unsettled = rivals or shortlisted(problem, after, 1)
        swapped: Sequence[Explanation] = ()
        if effort.retries and len(tried[0].causes) > 1 and unsettled:
            swapped = swap_step(tried[0], after.best(), report)
            if swapped[0] is not tried[0]:
                after, tried = screen(swapped[0].fit, causes, rng), [swapped[0]]
        current = _varied(tried[0])
        if current is not tried[0]:
            after = screen(current.fit, causes, rng)
        rough = roughness(current)
        screens.append(after)
        others_like = [e for e in tried[1:] if explained_away(e.causes[-1], screens[-2], after)]
        rivals = rivals_of(current, [*others_like, *swapped[1:]])
    found_causes = current.causes
    current = backward_elimination(current)
    failed = failed if current.causes == found_causes else frozenset()
    if current.causes and whole_effort.retries:
        final = reached(partial(finished, current.fit))
        current = Explanation(current.causes, final) if final else current
    # A rival that contains the accepted causes is no rival once a cause is dropped.
    rivals = tuple(e for e in rivals if not set(current.causes) <= set(e.causes))
    return Attribution(begun.baseline, tuple(screens), current, rivals, ranking, total, failed)


def _varied(explanation: Explanation) -> Explanation:
    """The explanation with what the runs differ in as it shows now that more is explained."""
    found = reached(partial(with_run_variation, explanation.fit))
    if found is None or found is explanation.fit:
        return explanation
    return Explanation(explanation.causes, found)


def rivals_of(best: Explanation, others: Iterable[Explanation]) -> tuple[Explanation, ...]:
    """Those of other explanations that the runs cannot tell from the best one."""
    return tuple(
        e
        for e in others
        if alike(best, e)
        and not same_causes(best.fit.problem, best.causes, e.causes)
        and not implausible_estimates(e.fit)
    )


def tied(best: Explanation, other: Explanation) -> bool:
    """Whether the evidence for two explanations is the same, whatever the colour of the residuals.

    If it is not, a further missing cause may hide the difference: that cause is sought first.
    """
    return other.score - best.score < POLICY.evidence_doubt


def ranking_of(tried: Sequence[Explanation], base: Explanation) -> tuple[Ranked, ...]:
    """Explanations by how well they predict runs left out, the best first.

    Args:
        tried: explanations with one cause more than ``base``.
        base: what they are judged against; a single run can be left out of nothing.
    """
    if len(base.fit.filtered) < 2:
        return ()
    before = left_out_scores(base)
    found = [_ranked(e.causes[-1], left_out_scores(e) - before) for e in tried]
    return tuple(sorted(found, key=lambda r: -r.score))


def _ranked(name: str, gains: FloatArray) -> Ranked:
    """A cause by what it gains in each run (runs,)."""
    count, total = len(gains), float(gains.sum())
    half = float(stdtrit(count - 1, 0.975) * gains.std(ddof=1) * np.sqrt(count))
    return Ranked(name, total, (total - half, total + half))


def roughness(explanation: Explanation) -> float:
    """Share of the evidence for an explanation that its simulation may get wrong.

    A further cause has to gain more than such an error would.
    """
    known = explanation.fit.problem.known
    return max((known[name].step_error ** 2 for name in explanation.fit.effects), default=0.0)


def _under_relaxed_noise(
    current: Explanation,
    chosen: Sequence[Signal],
    causes: Sequence[Cause],
    rng: np.random.Generator,
) -> tuple[Fit, Sequence[Signal]] | None:
    """The fit under relaxed noise where a drive may be out of step, and the effects it shows."""
    if not _may_be_out_of_step(current, chosen):
        return None
    relaxed = current.with_relaxed_noise
    if relaxed is None:
        return None
    shown = screen(relaxed, causes, rng)
    effects = sorted((s for s in shown.best() if s.cause.is_effect), key=lambda s: -s.uncorrected)
    first = [s for s in effects[: POLICY.most_relaxed] if s.uncorrected > POLICY.worth_coarse_fit]
    tried_anyway = current.fit.problem.out_of_step
    return relaxed, first + [s for s in effects if s.cause.name in tried_anyway and s not in first]


def _drifting(current: Explanation, screen: Screen, chosen: Sequence[Signal]) -> list[Signal]:
    """Effects that drift in phase.

    After many periods out of step the screen shows them no more than it shows others.
    """
    if not _may_be_out_of_step(current, chosen):
        return []
    known = current.fit.problem.known
    effects = [s for s in screen.best() if s.cause.is_effect and s not in chosen]
    return [s for s in effects if known[s.cause.name].drifts_in_phase]


def _may_be_out_of_step(current: Explanation, chosen: Sequence[Signal]) -> bool:
    """Whether a periodic drive may be out of step: no plausible disturbance explains the misfit.

    A drive out of step hides everything else, so it is the first cause to be found or none.
    """
    return not current.causes and bool(chosen) and bool(disturbance_at_limit(current.fit))


def _new(after: Screen, chosen: Sequence[Signal]) -> list[Signal]:
    """Effects that the first screen had not shown: the misfit then hid them."""
    known = {s.cause.name for s in chosen}
    leading = [s for s in after.best() if s.log_p < after.threshold and s.cause.is_effect]
    return [s for s in leading if s.cause.name not in known][:3]


def _like(winner: str, before: Screen, chosen: Sequence[Signal], problem: Problem) -> list[Signal]:
    """Effects known to look like the winner, whatever the screen made of them."""
    alike = set(problem.known[winner].confusable_with) if winner in problem.known else set()
    known = {winner, *(s.cause.name for s in chosen)}
    return [s for s in before.best() if s.cause.name in alike - known]


def shortlisted(
    problem: Problem,
    screen: Screen,
    count: int,
    least: float = 0.0,
    relaxed_log_p: float = 0.0,
    found: int = 0,
) -> list[Signal]:
    """The most significant causes, and among the others those known to look like the first.

    Effects and coefficients are two lists: what the tests of the two make of a large misfit does
    not compare. A strong effect is screened far from where it is, so its place among its like
    means little.

    Args:
        problem: what is fitted.
        screen: all causes against the present explanation.
        count: how many effects to try.
        least: statistic below which a simulation error explains a cause.
        relaxed_log_p: added to the log p-value that makes a cause significant.
        found: coefficients in the present explanation.
    """
    strong = [s for s in screen.best() if s.statistic >= least]
    effects = [
        s for s in strong if s.cause.is_effect and s.log_p < screen.threshold + relaxed_log_p
    ]
    lifted = [s for s in strong if not s.cause.is_effect]
    enough = _threshold_of_coefficients(screen, found) + relaxed_log_p
    coefficients = [s for s in lifted if s.log_p < enough]
    first = problem.known.get(effects[0].cause.name) if effects else None
    alike = set(first.confusable_with) if first else set()
    like_first = [s for s in effects[count:] if s.cause.name in alike]
    return [*effects[:count], *like_first, *coefficients[: max(1, count // 2)]]


def _threshold_of_coefficients(screen: Screen, found: int) -> float:
    """Log p-value that makes a coefficient significant.

    The first has to stand out among all causes. A parameter file that is wrong in one place is
    often wrong in several, so the next ones are judged among coefficients alone, and the share of
    false names is bounded (Benjamini and Hochberg, 1995).
    """
    if not found:
        return screen.threshold
    count = sum(not s.cause.is_effect for s in screen.signals) + found
    return max(screen.threshold, float(np.log(screen.level * (found + 1) / count)))


def explained_away(cause: str, before: Screen, after: Screen) -> bool:
    """Whether a cause lost most of its evidence when another was accepted.

    If it did not, the two explain different parts of the data: it is a further cause, no rival.
    """
    evidence = {s.cause.name: s.statistic for s in before.best()}
    left = {s.cause.name: s.statistic for s in after.best()}
    return left.get(cause, 0.0) < 0.5 * evidence.get(cause, np.inf)


def alike(best: Explanation, other: Explanation) -> bool:
    """Whether two explanations cannot be told apart on these runs.

    They are alike when the evidence differs by less than :data:`DOUBT`, counted as the screen
    counts it: with coloured residuals, divided by the variance inflation of the difference.
    """
    gap = other.score - best.score
    left, there = best.fit.linearised.residuals, other.fit.linearised.residuals
    apart = (there - left)[:, None]
    noise = left - apart[:, 0] * (apart[:, 0] @ left) / max(float(apart[:, 0] @ apart[:, 0]), 1e-12)
    return bool(gap < POLICY.evidence_doubt * Projector(best.fit).variance_inflation(apart, noise))
