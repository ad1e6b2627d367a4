"""Result of an inference: what explains the runs, what it leaves, and what they could show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.budget import Budget
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.gain import ClosedGap
from fish_env.inference.hypotheses import ParameterId
from fish_env.inference.preconditions import Precondition
from fish_env.inference.verdict import Verdict


class ResidualModel(Protocol):
    """An empirical model of what no known cause explains; its form is the vehicle's business."""

    @property
    def held_out_gain(self) -> float | None:
        """Log likelihood that held-out runs gain by it; None without such runs."""
        ...

    @property
    def fit(self) -> Fit:
        """The fit with the model in place."""
        ...


@dataclass(frozen=True)
class Estimate:
    """A parameter of an accepted cause.

    Attributes:
        value: in the parameter's unit.
        interval: 95 % interval.
    """

    value: float
    interval: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Result:
    """Result of an inference.

    Attributes:
        attribution: search among causes.
        adequacy: whether the accepted explanation reaches the noise floor.
        preconditions: what the runs could show of each effect.
        verdict: the answer.
        gap: share of the reachable gap that the accepted causes close on held-out runs; None
            without such runs, or without causes.
        residual: model of what no known cause explains; None where nothing is left, or where the
            vehicle has no such model.
        budget: where the misfit of the nominal model goes; None where it has none.
    """

    attribution: Attribution
    adequacy: Adequacy
    preconditions: tuple[Precondition, ...]
    verdict: Verdict
    gap: ClosedGap | None = None
    residual: ResidualModel | None = None
    budget: Budget | None = None

    @property
    def baseline(self) -> Fit:
        """The refitted baseline."""
        return self.attribution.baseline.fit

    @property
    def accepted(self) -> Fit:
        """The accepted fit: with causes, or the refitted baseline."""
        return self.attribution.accepted.fit

    @property
    def cut_short(self) -> bool:
        """Whether the search ended because so much had been simulated."""
        return self.baseline.problem.work.cut_short

    def estimates(self) -> dict[ParameterId, Estimate]:
        """Parameters of the verdict's causes."""
        fit, causes = self.accepted, set(self.verdict.causes)
        ids: list[ParameterId] = [p for p in fit.point.effects if p.effect in causes]
        ids += [c for c in fit.problem.baseline.ids if c in causes]
        values = dict(zip(fit.ids, fit.estimates.tolist(), strict=True))
        return {id: Estimate(values[id], fit.interval(id)) for id in ids}
