"""What every diagnosis holds, whatever was measured."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.next_experiment import Proposal
from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.budget import Budget
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.preconditions import Precondition
from fish_env.inference.verdict import Verdict


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosed:
    """Everything that runs and tables have in common.

    Attributes:
        dataset: what was measured.
        attribution: search among causes.
        adequacy: whether the accepted explanation reaches the floor.
        preconditions: what the data could show.
        verdict: the answer.
        misfit: whitened errors by channel, baseline and accepted.
        gain: on final data; None without an extension, or without such data.
        next_experiment: what separates what is still open; None where nothing is.
        budget: where the misfit of the nominal simulation goes; None where it has none.
        seed: of splits and null distributions.
        quick: whether this is a first look.
        runtime_s: wall time.
    """

    dataset: Dataset | SteadyDataset
    attribution: Attribution
    adequacy: Adequacy
    preconditions: tuple[Precondition, ...]
    verdict: Verdict
    misfit: dict[str, Pair]
    gain: Gain | None
    next_experiment: Proposal | None
    budget: Budget | None
    seed: int
    quick: bool
    runtime_s: float

    @property
    def accepted(self) -> Fit:
        """The accepted fit: extended, or the refitted baseline."""
        return self.attribution.accepted.fit
