"""From the steps of a search to estimates to be published, and which of its kind each cause is."""

from __future__ import annotations

from functools import partial

from fish_env.inference.elimination import backward_elimination
from fish_env.inference.estimate.again import to_publish
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.lookalikes import asked_of_lags, asked_of_rates, rates_asked_again
from fish_env.inference.progress import Report
from fish_env.inference.screening import Screen


def published(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation with converged estimates, and those with a look-alike that do as well.

    Where each run has a drive of its own fits take longest. So rates, which long steps get right,
    are compared in these, and lags, which they do not, in the steps of published estimates.

    Args:
        current: causes with their fit, each compared with doing without it.
        shown: causes that are not among them.
        report: told what is being done.
    """
    if not current.fit.problem.drive.uneven:
        return _converged(current, report), ()
    begun = current
    asked, rates = asked_of_rates(begun, shown, report)
    current = _converged(asked, report, judged=True)
    best, lags = asked_of_lags(current, shown, report)
    if best is current:
        return best, (*rates, *lags)
    others = {e.causes: e for e in (begun, *rates)}.values()
    best, rates = rates_asked_again(best, asked, others, report)
    return best, (*rates, *lags)


def _converged(current: Explanation, report: Report, judged: bool = False) -> Explanation:
    """The explanation with converged estimates, and without causes that these do not need.

    Args:
        current: causes with their fit.
        report: told what is being done.
        judged: whether what each cause explains was enough in long steps, so that only what the
            estimates say is in question.
    """
    report("iterating the estimates to convergence")
    final = reached(partial(to_publish, current.fit))
    if final is None:
        return current
    report("removing unnecessary causes")
    return backward_elimination(Explanation(current.causes, final), judged)[0]
