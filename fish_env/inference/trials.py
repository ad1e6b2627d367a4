"""Effects that a swamping disturbance hides from the linear model, each tried in a fit of its own.

Where runs differ in their drive, a lag puts all of them out of step, each by another amount. The
disturbance then grows until it follows everything, and no slope under it shows a lag. A fit does:
from a lag of some size and under a small disturbance its few steps end far below a fit without it.

Once one lag was found, the disturbance is smaller, but a second one hides still: the first lag and
the runs' own clocks have made up for it, and leave it only together. There a trial goes on from the
fit with the first lag.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from fish_env.inference.adequacy import beyond_plausible
from fish_env.inference.estimate.again import following
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter, where_ended
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.settle import usual_runs
from fish_env.inference.explanation import Explanation, fitted_again, reached
from fish_env.inference.hypotheses import EffectName, EffectParameterId, listed
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.screening import Screen
from fish_env.inference.search import is_off
from fish_env.inference.starts import probed


def tried_out(current: Explanation, shown: Screen, report: Report) -> Explanation | None:
    """The explanation with the hidden effect that explains most; None where none explains more.

    Lags of different kinds explain nearly alike. Those whose few steps end close to the best are
    fitted to all runs.

    Args:
        current: causes accepted so far, beside a large misfit.
        shown: all causes against it.
        report: told what is being done.
    """
    problem = current.fit.problem
    names, fresh = problem.hidden_by_drive, problem.swamped(current.fit.noise)
    hides = problem.drive.uneven and (fresh or not {*current.causes}.isdisjoint(names))
    hidden = [s for s in shown.best() if s.cause.id in names]
    if not hides or not hidden:
        return None
    report(f"trying {listed(s.cause.id for s in hidden)} one at a time")
    trials = Trials(current, fresh)
    closest = trials.promising(hidden)
    if closest:
        report(f"fitting {listed(closest)}, each alone")
    whole = [partial(trials.in_all_runs, name, trial) for name, trial in closest.items()]
    fitted = [more for more in side_by_side(whole) if more]
    best = min(fitted, key=lambda more: more.score, default=current)
    return best if best.score < current.score - POLICY.evidence_doubt else None


@dataclass(frozen=True, eq=False)
class Trials:
    """Fits of a few steps with one more effect.

    Attributes:
        current: causes accepted so far.
        fresh: whether they begin from a nominal vehicle and under a small disturbance, else from
            the fit with these causes. Coefficients and runs' own numbers of a fit beside a swamping
            disturbance have gone far to make up for what is missing. That disturbance would follow
            everything, tell trials apart by little else than its size, and take longest to find.
    """

    current: Explanation
    fresh: bool

    def promising(self, hidden: Sequence[Signal]) -> dict[EffectName, CoarseFit]:
        """The few trials to go on from."""
        begun = [begin for signal in hidden for begin in self._begun(signal)]
        tasks = [partial(self._trial, *begin) for begin in [("", self._at({})), *begun]]
        without, *found = side_by_side(tasks)
        return _closest(self.current, without, [f for f in found if f])

    def in_all_runs(self, name: EffectName, trial: CoarseFit) -> Explanation | None:
        """The explanation with one more effect, from its trial; None where it is of no use."""
        problem = following(self.current.fit.problem, trial)
        runs, noise = self._under(problem, trial.point)
        whole = fitted_again(runs, trial, noise)
        if whole is None or beyond_plausible(whole, name) or is_off(problem, whole.point, name):
            return None
        return Explanation((*self.current.causes, name), whole)

    @cached_property
    def _few(self) -> Problem:
        return self.current.fit.problem.subset(POLICY.few_runs)

    @cached_property
    def _fitter(self) -> CoarseFitter:
        return CoarseFitter(self.current.fit)

    def _at(self, further: Mapping[EffectParameterId, float]) -> Point:
        """Where a trial begins, with values of a further effect."""
        own = self.current.fit
        z = self._few.start.z if self.fresh else own.point.z
        return Point(z, {**own.point.effects, **further})

    def _under(self, problem: Problem, begin: Point) -> tuple[Problem, Any]:
        """Runs to begin with, and their noise model."""
        if not self.fresh:
            return problem, self.current.fit.noise
        noise = problem.default_noise()
        return usual_runs(problem, begin, noise), noise

    def _begun(self, signal: Signal) -> list[tuple[EffectName, Point]]:
        """An effect with where its trials begin: from all its sizes, or the likeliest of them."""
        own, name = self.current.fit, signal.cause.effect
        begin = [self._at(values) for values in probed(own.problem, signal)]
        if not self.fresh:
            most = POLICY.most_close_trials
            begin = self._fitter.promising((*own.effects, name), own.released, begin, most)
        return [(name, point) for point in begin]

    def _trial(self, name: str, begin: Point) -> CoarseFit | None:
        """A few steps on a few runs.

        Args:
            name: effect to add; none if empty.
            begin: where it begins.
        """
        own = self.current.fit
        effects = (*own.effects, name) if name else own.effects
        runs, noise = self._under(self._few, begin)
        start = (effects, begin, noise, own.released)
        steps = POLICY.trial_steps
        found = reached(lambda: fit(runs, *start, refit_noise=False, iterations=steps))
        if found is None:
            return None
        return where_ended(found)  # the fit itself takes much memory, and there are many


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
