"""Effects that a swamping disturbance hides from the linear model, each tried in a fit of its own.

Where runs differ in their drive, a lag puts all of them out of step, each by another amount. The
disturbance then grows until it follows everything, and no slope under it shows a lag. A fit does:
from a lag of some size and under a small disturbance its few steps end far below a fit without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from fish_env.inference.adequacy import beyond_plausible
from fish_env.inference.estimate.again import following
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.settle import usual_runs
from fish_env.inference.explanation import Explanation, fitted_again, reached
from fish_env.inference.hypotheses import EffectName, EffectParameterId, listed
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.projection import Signal
from fish_env.inference.screening import Screen
from fish_env.inference.search import is_off
from fish_env.inference.starts import probed


def tried_out(
    current: Explanation, shown: Screen, report: Callable[[str], None]
) -> Explanation | None:
    """The explanation with the hidden effect that explains most; None where none explains more.

    Lags of different kinds explain nearly alike. Those whose few steps end close to the best are
    fitted to all runs.

    Args:
        current: causes accepted so far, beside a large misfit.
        shown: all causes against it.
        report: told what is being done.
    """
    problem = current.fit.problem
    hidden = [s for s in shown.best() if s.cause.id in problem.hidden_by_drive]
    swamped = problem.drive.uneven and problem.swamped(current.fit.noise)
    if not hidden or not swamped:
        return None
    report(f"trying {listed(s.cause.id for s in hidden)} one at a time")
    closest = _promising(current, hidden)
    if closest:
        report(f"fitting {listed(closest)}, each alone")
    whole = [partial(_in_all_runs, current, name, trial) for name, trial in closest.items()]
    fitted = [more for more in side_by_side(whole) if more]
    best = min(fitted, key=lambda more: more.score, default=current)
    return best if best.score < current.score - POLICY.evidence_doubt else None


def _promising(current: Explanation, hidden: Sequence[Signal]) -> dict[EffectName, CoarseFit]:
    """The few trials to go on from."""
    problem = current.fit.problem
    begun = [(s.cause.effect, values) for s in hidden for values in probed(problem, s)]
    tasks = [partial(_trial, current, *begin) for begin in [("", {}), *begun]]
    without, *found = side_by_side(tasks)
    return _closest(current, without, [f for f in found if f])


def _closest(
    current: Explanation, without: CoarseFit | None, found: Sequence[CoarseFit]
) -> dict[EffectName, CoarseFit]:
    """The trial that explains most, and one of another effect that explains nearly as much."""
    best: dict[EffectName, CoarseFit] = {}
    for trial in sorted(found, key=lambda trial: trial.objective):
        (name,) = map(EffectName, {*trial.effects} - {*current.fit.effects})
        best.setdefault(name, trial)
    if not best:
        return {}
    least = next(iter(best.values())).objective
    if without is None:
        return dict(list(best.items())[:1])
    if least > without.objective - POLICY.evidence_doubt:
        return {}
    enough = least + POLICY.coarse_fit_behind * (without.objective - least)
    few = list(best.items())[: POLICY.most_close_trials]
    return {name: trial for name, trial in few if trial.objective <= enough}


def _in_all_runs(current: Explanation, name: EffectName, trial: CoarseFit) -> Explanation | None:
    """The explanation with one more effect, from its trial; None where the fit is of no use."""
    problem = following(current.fit.problem, trial)
    noise = problem.default_noise()
    whole = fitted_again(usual_runs(problem, trial.point, noise), trial, noise)
    if whole is None or beyond_plausible(whole, name) or is_off(problem, whole.point, name):
        return None
    return Explanation((*current.causes, name), whole)


def _trial(
    current: Explanation, name: str, values: dict[EffectParameterId, float]
) -> CoarseFit | None:
    """A few steps on a few runs, from a nominal vehicle and under a small disturbance.

    Coefficients and runs' own numbers of the present fit have gone far to make up for what is
    missing. The disturbance stays small: what it would grow to beside what is still missing follows
    everything, tells trials apart by little else than its size, and takes longest to find.

    Args:
        current: causes accepted so far.
        name: effect to add; none if empty.
        values: where its parameters begin.
    """
    own = current.fit
    few = own.problem.subset(POLICY.few_runs)
    effects = (*own.effects, name) if name else own.effects
    begin = Point(few.start.z, {**own.point.effects, **values})
    noise = few.default_noise()
    fresh = usual_runs(few, begin, noise)
    start = (effects, begin, noise, own.released)
    steps = POLICY.trial_steps
    found = reached(lambda: fit(fresh, *start, refit_noise=False, iterations=steps))
    if found is None:
        return None
    # The fit itself takes much memory, and there are many.
    return CoarseFit(found.effects, found.released, found.point, found.objective)
