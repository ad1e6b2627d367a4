"""A search begun again beside the nominal vehicle, where the first was lost in a disturbance.

Where two large causes act, no fit with one of them leads anywhere: coefficients go to their bounds
and the disturbance to its limit, and what then seems to be missing is neither cause. Without a fit
they show. Beside the nominal vehicle, and under the small disturbance of runs that differ, the runs
are likeliest with the larger cause, and then with the other one beside it. A fit with both begins
there. It counts only if its disturbance is plausible again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Any

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.attribution import Attribution, extended, settled
from fish_env.inference.effort import FULL
from fish_env.inference.estimate.again import to_search
from fish_env.inference.estimate.fit import objective_at
from fish_env.inference.estimate.settle import usual_runs
from fish_env.inference.explanation import Explanation, fitted_again, on_few_runs
from fish_env.inference.hypotheses import EffectName, EffectParameterId, listed
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause, effect_values
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.screening import screen
from fish_env.inference.starts import on_both_sides

Values = Mapping[EffectParameterId, float]


def searched_afresh(
    before: Attribution, causes: Sequence[Cause], rng: np.random.Generator, report: Report
) -> Attribution:
    """The attribution by a search from causes beside the nominal vehicle; as it was if no better.

    Args:
        before: what was found, its disturbance at the limit.
        causes: causes to consider.
        rng: for null distributions.
        report: told what is being done.
    """
    nothing = before.baseline
    begun = beside_nominal(nothing.fit.problem, causes, report)
    if begun is None:
        return before
    report("screening causes")
    first = replace(
        before, accepted=begun, shown=screen(begun.fit, causes, rng),
        gain=nothing.score - begun.score, rivals=(), failed=frozenset(),
    )  # fmt: skip
    found = extended(first, causes, rng, FULL, report)
    if found is first:
        found = settled(first, True, report)
    better = found.accepted.score < before.accepted.score - POLICY.evidence_doubt
    return found if better and not disturbance_at_limit(found.accepted.fit) else before


def beside_nominal(problem: Problem, causes: Sequence[Cause], report: Report) -> Explanation | None:
    """Effects beside which a fit from nominal coefficients leaves a plausible disturbance.

    They are added one after another until they are enough; None where a few are not.

    Args:
        problem: the runs.
        causes: causes to consider.
        report: told what is being done.
    """
    own = to_search(problem)
    noise = own.differing_noise()
    nominal = Nominal(usual_runs(own, own.start, noise), noise, problem.drive.in_step)
    for _ in range(POLICY.most_beside_nominal):
        report(f"trying each cause beside {listed(nominal.effects) or 'the nominal model'}")
        more = nominal.with_likeliest(causes)
        if more is None:
            return None
        nominal = more
        report(f"fitting {listed(nominal.effects)} from nominal coefficients")
        found = nominal.fitted()
        if found is not None:
            return found
    return None


@dataclass(frozen=True, eq=False)
class Nominal:
    """Runs of a vehicle with nominal coefficients, and effects of some size.

    Attributes:
        problem: the runs, with no number of their own.
        noise: noise model to begin from.
        values: parameters of the effects.
    """

    problem: Problem
    noise: Any
    values: Values

    @property
    def effects(self) -> tuple[EffectName, ...]:
        """Names of the effects, in the order they were added."""
        return tuple(dict.fromkeys(EffectName(id.effect) for id in self.values))

    def with_likeliest(self, causes: Sequence[Cause]) -> Nominal | None:
        """With the effect beside which the runs are likeliest; None where none helps.

        All settings of all effects are tried on one run, and the best part of them on a few. The
        gains of a filter that has run without the effect would not do: the motion is another.
        Source: successive halving (Jamieson and Talwalkar, 2016, "Non-stochastic best arm
        identification and hyperparameter optimization", AISTATS).
        """
        one, few = self.problem.subset(1), self.problem.subset(POLICY.few_runs)
        further: list[Values] = [{**self.values, **more} for more in self._further(causes)]
        tried = self._ranked(one, further)
        likely = [values for _, values in tried[: ceil(len(tried) / POLICY.halving)]]
        best = next(iter(self._ranked(few, likely)), None)
        without = self._objective(few, self.values)
        if best is None or best[0] > without - POLICY.evidence_doubt:
            return None
        return replace(self, values=best[1])

    def fitted(self) -> Explanation | None:
        """The fit with all effects; None where its disturbance is at its limit."""
        begin = Point(self.problem.start.z, self.values)
        few = on_few_runs(self.problem, self.effects, [begin], self.noise)
        if few is None or disturbance_at_limit(few):
            return None
        whole = fitted_again(self.problem, few, few.noise)
        if whole is None or disturbance_at_limit(whole):
            return None
        return Explanation(self.effects, whole)

    def _further(self, causes: Iterable[Cause]) -> Iterable[Values]:
        """All settings of all effects that were not added yet."""
        for cause in causes:
            if cause.is_effect and cause.effect not in self.effects:
                effect = self.problem.known[cause.effect]
                for setting in on_both_sides(effect, (p for own in cause.probes for p in own)):
                    yield effect_values(self.problem, cause.effect, setting)

    def _ranked(self, runs: Problem, settings: Sequence[Values]) -> list[tuple[float, Values]]:
        """Objective and setting of those that the simulation does not diverge with, best first."""
        found = side_by_side([partial(self._objective, runs, values) for values in settings])
        pairs = [(value, own) for value, own in zip(found, settings, strict=True) if value < np.inf]
        return sorted(pairs, key=lambda pair: pair[0])

    def _objective(self, runs: Problem, values: Values) -> float:
        """-2 log likelihood of some runs, each evaluated anew."""
        effects = tuple(dict.fromkeys(id.effect for id in values))
        return objective_at(runs, effects, Point(runs.start.z, values), self.noise)
