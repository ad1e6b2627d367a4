"""Which causes explain the misfit: forward selection, then backward elimination."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit, implausible_estimates
from fish_env.inference.drive import beside_drive, drifting, measured, under_relaxed_noise
from fish_env.inference.effort import FULL, Effort
from fish_env.inference.elimination import (
    backward_elimination,
    last_departs,
    without_idle,
    without_insignificant,
)
from fish_env.inference.estimate.again import arrived, finished, quietened
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.first_screen import first_screen, with_differences
from fish_env.inference.hypotheses import CauseId, listed
from fish_env.inference.in_common import with_common_errors
from fish_env.inference.many_causes import challenged, pursue
from fish_env.inference.parallel import both, side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.preconditions import Precondition, preconditions
from fish_env.inference.probes import Cause
from fish_env.inference.progress import Report, silent
from fish_env.inference.projection import Signal
from fish_env.inference.publication import published
from fish_env.inference.ranking import Ranked, ranking_of
from fish_env.inference.rivals import explained_away, rivals_of, tied
from fish_env.inference.screening import Screen, screen
from fish_env.inference.search import refits, restart_from_winner
from fish_env.inference.shortlist import (
    like,
    newly_shown,
    shortlisted,
    threshold_of_coefficients,
)
from fish_env.inference.trials import tried_out


@dataclass(frozen=True, eq=False)
class Attribution:
    """Result of the search.

    Attributes:
        baseline: refitted baseline.
        first: screen of the baseline.
        shown: screen of the accepted explanation.
        accepted: explanation of the last step (the baseline itself when nothing was added).
        rivals: explanations that fit as well as the accepted one.
        ranking: causes fitted in the first step, best first.
        gain: of all accepted causes together, in the same unit.
        failed: causes that were fitted beside the accepted ones and explained too little more.
        preconditions: what the baseline says of each effect before any is fitted.
    """

    baseline: Explanation
    first: Screen
    shown: Screen
    accepted: Explanation
    rivals: tuple[Explanation, ...]
    ranking: tuple[Ranked, ...]
    gain: float
    failed: frozenset[CauseId] = frozenset()
    preconditions: tuple[Precondition, ...] = ()


def attribute(
    baseline: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort = FULL,
    report: Report = silent,
) -> Attribution:
    """Add causes while one is significant, keep all that explain the data alike.

    Where none is, all are asked again beside what runs differ in, if that explains anything.

    Args:
        baseline: refitted baseline, with the runs it was fitted to.
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told what is being done.
    """
    usual = (causes, rng, effort, report)
    begun = _begun(baseline, *usual)
    found, nothing = extended(begun, *usual), begun.accepted
    varied = nothing if found.accepted.causes else with_differences(nothing)
    if varied is nothing:
        return found
    report("screening causes beside what the runs differ in")
    shown = screen(varied.fit, causes, rng)
    again = replace(begun, baseline=varied, first=shown, shown=shown, accepted=varied)
    return extended(again, *usual)


def _begun(
    baseline: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort,
    report: Report,
) -> Attribution:
    """What the baseline says, without a cause."""
    report("screening causes")
    nothing, first = first_screen(Explanation((), baseline), causes, rng)
    own = nothing.fit
    report("computing detectable sizes")
    relax = effort.retries and disturbance_at_limit(own) and not own.problem.drive.known
    known, _ = both(  # where the disturbance is at its limit, relaxed noise is tried in any case
        partial(preconditions, own.problem, first, causes, own if effort.retries else None),
        lambda: nothing.with_relaxed_noise if relax else None,
    )
    first = first.without_changes()
    return Attribution(nothing, first, first, nothing, (), (), 0.0, preconditions=known)


def extended(
    begun: Attribution,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort = FULL,
    report: Report = silent,
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
    search = Search(causes, rng, effort, report, relaxed_log_p)
    found, together = search.hidden(search.measured(begun)), effort.retries
    work = begun.accepted.fit.problem.work
    while len(found.accepted.causes) < POLICY.most_causes and work.allows_more():
        if found.accepted.causes and together:
            found, together = search.together(found), False
            continue
        if any(tied(found.accepted, e) for e in found.rivals):
            break
        more = search.contest(found)
        if more is None or more.accepted.causes == found.accepted.causes:
            found = more or found
            break
        found = more
    if begun.accepted.causes and found.accepted is begun.accepted:
        return begun  # settled before
    if effort.retries:
        found = search.in_common(found)
    return settled(found, effort.retries, report, relaxed_log_p)


def settled(
    found: Attribution,
    thoroughly: bool,
    report: Report,
    relaxed_log_p: float = 0.0,
) -> Attribution:
    """The attribution without causes that are not needed, its estimates fitted to the end.

    Args:
        found: what the search has found.
        thoroughly: whether estimates are to be published.
        report: told what is being done.
        relaxed_log_p: added to the log p-value that makes a cause significant.
    """
    threshold = partial(threshold_of_coefficients, found.shown, relaxed_log_p=relaxed_log_p)
    if found.accepted.causes:
        report("removing unnecessary causes")
    significant = without_insignificant(found.accepted, threshold, report)
    current, unnecessary = backward_elimination(significant)
    failed = found.failed if current.causes == found.accepted.causes else frozenset()
    alike: tuple[Explanation, ...] = ()
    # What else is missing moves estimates by more than a few steps more would.
    if current.causes and thoroughly and not disturbance_at_limit(current.fit):
        current, alike = published(current, found.shown, report)
        before, current = current, without_insignificant(current, threshold, report)
        if current is not before:
            current = Explanation(current.causes, finished(current.fit))
    rivals = (*found.rivals, *unnecessary, *alike)
    if thoroughly and rivals:
        rivals = tuple(side_by_side([partial(without_idle, e) for e in rivals]))
    # One that contains the accepted causes is no rival once a cause is dropped.
    rivals = tuple(e for e in rivals if e.causes and not set(current.causes) <= set(e.causes))
    return replace(found, accepted=current, rivals=rivals, failed=failed)


@dataclass(frozen=True, eq=False)
class Search:
    """How causes are added to an attribution.

    Attributes:
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told what is being done.
        relaxed_log_p: added to the log p-value that makes a cause significant.
    """

    causes: Sequence[Cause]
    rng: np.random.Generator
    effort: Effort
    report: Report
    relaxed_log_p: float

    def measured(self, begun: Attribution) -> Attribution:
        """With what was measured to put the drive in step; the same without such, or beside causes.

        Whatever else is wrong shows only once the drive is in step.
        """
        nothing = begun.accepted
        accepted = None if nothing.causes else measured(nothing, self.report)
        if accepted is None:
            return begun
        after = screen(accepted.fit, self.causes, self.rng)
        return replace(begun, accepted=accepted, shown=after, gain=nothing.score - accepted.score)

    def hidden(self, begun: Attribution) -> Attribution:
        """With an effect that a swamping disturbance hides; the same without, or beside causes.

        No screen shows it, and what makes up for it would be found instead.
        """
        nothing = begun.accepted
        if nothing.causes or not (self.effort.retries and disturbance_at_limit(nothing.fit)):
            return begun
        more = tried_out(nothing, begun.shown, self.report)
        if more is None:
            return begun
        after = screen(more.fit, self.causes, self.rng)
        return replace(begun, accepted=more, shown=after, gain=nothing.score - more.score)

    def together(self, found: Attribution) -> Attribution:
        """With further effects that are needed beside those found, and what the runs differ in."""
        if not found.accepted.fit.problem.work.allows_more():
            return found
        found = self.simplest_first(found)
        before = found.accepted
        current, after, replaced = pursue(
            before, found.shown, self.causes, self.rng, self.report, self.relaxed_log_p
        )
        if current is before:
            return found
        gain = found.gain + before.score - current.score
        if current.causes == before.causes:
            alike = tuple(e.varied(beside_misfit=True) for e in found.rivals)
            return replace(found, accepted=current, rivals=alike, shown=after, gain=gain)
        current, rivals = challenged(current, after, found.rivals, self.report, replaced)
        return replace(
            found, accepted=current, rivals=rivals, shown=after, gain=gain,
            failed=frozenset(),
        )  # fmt: skip

    def simplest_first(self, found: Attribution) -> Attribution:
        """With the rival of fewest numbers in the lead, where one cause is known and others show.

        What more numbers explain then is often part of what is missing. They would go on to do so
        beside the effects that are found next, whose fits take longer with each number.
        """
        best = found.accepted
        others_show = shortlisted(best.fit.problem, found.shown, 1, self.relaxed_log_p)
        if len(best.causes) != 1 or not others_show:
            return found
        simple = min((best, *found.rivals), key=lambda e: len(e.fit.ids))
        if simple is best:
            return found
        self.report(f"going on with {listed(simple.causes)}, which explains as much")
        leading = simple.varied()
        others = tuple(e for e in (best, *found.rivals) if e is not simple)
        return replace(
            found, accepted=leading, rivals=others, gain=found.gain + best.score - leading.score,
            shown=screen(leading.fit, self.causes, self.rng),
        )  # fmt: skip

    def in_common(self, found: Attribution) -> Attribution:
        """With what runs share as effects, and further effects that show beside these.

        Where the disturbance is at its limit and runs share nothing, none was of use, and none will
        be: only numbers of runs have gone.
        """
        before = found.accepted
        current = with_common_errors(before, found.shown.threshold, self.report)
        if current is before:
            return found
        after = screen(current.fit, self.causes, self.rng)
        gain = found.gain + before.score - current.score
        rivals = rivals_of(current, found.rivals)
        more = replace(
            found, accepted=current, rivals=rivals, shown=after, gain=gain, failed=frozenset()
        )
        same = current.causes == before.causes
        return more if same and disturbance_at_limit(current.fit) else self.together(more)

    def in_step(self, begun: Attribution, best: Explanation) -> Attribution | None:
        """With a cause and what puts the drive in step; None where one cause explains more.

        Args:
            begun: without a cause.
            best: with the best single cause; without one where none shows.
        """
        nothing, problem = begun.accepted, best.fit.problem
        hidden = problem.swamped(best.fit.noise) or not problem.drive.known
        if not (self.effort.retries and disturbance_at_limit(best.fit) and hidden):
            return None
        more = beside_drive(nothing, best, self.causes, self.rng, self.effort, self.report)
        if more is None:
            return None
        accepted = more.explanation
        after = screen(accepted.fit, self.causes, self.rng)
        return replace(
            begun, accepted=accepted, shown=after,
            ranking=ranking_of(more.tried, more.base), gain=nothing.score - accepted.score,
        )  # fmt: skip

    def contest(self, found: Attribution) -> Attribution | None:
        """With the best of all causes that show; the same if it explains too little, None if none.

        Beside causes only coefficients compete, and only under a plausible disturbance: effects are
        found together, and what else is missing pulls at coefficients.
        """
        current, effort = found.accepted, self.effort
        problem, shown = current.fit.problem, found.shown
        if current.causes and effort.retries:
            effort = effort.reduced
            if disturbance_at_limit(current.fit):
                return None
        lifted = len(current.fit.released)
        chosen = shortlisted(problem, shown, effort.shortlist, self.relaxed_log_p, lifted)
        if current.causes and self.effort.retries:
            chosen = [signal for signal in chosen if not signal.cause.is_effect]
        chosen = [signal for signal in chosen if signal.cause.id not in found.failed]
        tried, base = self._tried(current, chosen, shown, effort)
        leading = tried[0] if tried else current
        in_step = None if current.causes else self.in_step(found, leading)
        if in_step is not None or base is None:
            return in_step
        ranking = found.ranking or ranking_of(tried, base)
        if current.causes and not implausible_estimates(current.fit):
            tried = [e for e in tried if not implausible_estimates(e.fit)]
        gain = base.score - tried[0].score if tried else 0.0
        enough = threshold_of_coefficients(shown, lifted, self.relaxed_log_p)
        weak = gain < POLICY.evidence_doubt
        if weak or (current.causes and not last_departs(tried[0], enough)):
            failed = found.failed | {signal.cause.id for signal in chosen}
            return replace(found, ranking=ranking, failed=failed)
        best, others, after = self._questioned(current, tried, chosen, shown)
        others = [e for e in others if explained_away(e.causes[-1], shown, after)]
        return replace(
            found, accepted=best, shown=after, ranking=ranking,
            rivals=rivals_of(best, others), gain=found.gain + gain, failed=frozenset(),
        )  # fmt: skip

    def _tried(
        self, current: Explanation, chosen: Sequence[Signal], shown: Screen, effort: Effort
    ) -> tuple[list[Explanation], Explanation | None]:
        """Full fits with one cause more, and the present one under the best one's noise."""
        unseen = drifting(current, shown, chosen)
        relaxed = None
        if effort.retries:
            relaxed = under_relaxed_noise(current, chosen, self.causes, self.rng)
        problem = current.fit.problem
        alike = partial(like, before=shown, chosen=[*chosen, *unseen], problem=problem)
        return refits(current, chosen, self.report, relaxed, effort, alike, unseen)

    def _questioned(
        self,
        current: Explanation,
        tried: list[Explanation],
        chosen: Sequence[Signal],
        shown: Screen,
    ) -> tuple[Explanation, list[Explanation], Screen]:
        """The best explanation, the others, and the screen of the best.

        The others begin again from where the best one is, if it leaves something.
        """
        best = Explanation(tried[0].causes, arrived(quietened(tried[0].fit)))
        tried = [best, *tried[1:]]
        after = screen(best.fit, self.causes, self.rng)
        problem = best.fit.problem
        if self.effort.retries and not current.causes and shortlisted(problem, after, 1):
            others = newly_shown(after, chosen)
            others += like(best.causes[-1], shown, others, problem)
            tried = restart_from_winner(current, tried, others, self.report)
        varied = tried[0].varied()
        if varied is not best:
            after = screen(varied.fit, self.causes, self.rng)
        return varied, tried[1:], after
