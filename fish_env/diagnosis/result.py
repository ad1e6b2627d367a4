"""What a diagnosis holds: of every kind of data, of runs over time, of tables."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.data.schema import Dataset, SteadyDataset
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.inputs.check import Inputs
from fish_env.diagnosis.next_experiment import Proposal
from fish_env.diagnosis.regimes import Localisation
from fish_env.diagnosis.residual_model import ResidualModel
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tables.problem import TableProblem
from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.budget import Budget
from fish_env.inference.effort import CUT_SHORT, effort_of
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.preconditions import Precondition
from fish_env.inference.verdict import Verdict
from fish_env.rigidbody.consistency import Consistency
from fish_env.rigidbody.noise_floor import Floor
from fish_env.rigidbody.outliers import Outliers


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
        quick: whether this is quick mode.
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis(Diagnosed):
    """Everything a diagnosis of runs found.

    Attributes:
        outliers: samples of each channel that were left out.
        inputs: what is wrong with the data or their description, and the corrected data, which
            everything else is about.
        final_runs: ids of the held-out runs.
        floors: noise of each channel, from the data alone.
        consistency: whether the channels agree among themselves.
        problem: the others.
        localisation: where in the regime the baseline's misfit sits.
        residual: what no known cause explains, as a sum of simple wrenches, if it can be so told.
    """

    dataset: Dataset
    outliers: tuple[Outliers, ...]
    inputs: Inputs
    final_runs: tuple[str, ...]
    floors: tuple[Floor, ...]
    consistency: Consistency
    problem: SeriesProblem
    localisation: Localisation
    residual: ResidualModel | None

    @property
    def cut_short(self) -> bool:
        """Whether the search ended because so much had been simulated."""
        return self.problem.work.cut_short

    @property
    def left_out(self) -> tuple[str, ...]:
        """In words, what another diagnosis of the same runs would do beyond this one."""
        return CUT_SHORT if self.cut_short else effort_of(self.quick).left_out


@dataclass(frozen=True, eq=False, kw_only=True)
class TableDiagnosis(Diagnosed):
    """Everything a diagnosis of a table found.

    Attributes:
        problem: the conditions that were fitted.
        notes: for the user.
    """

    dataset: SteadyDataset
    problem: TableProblem
    notes: tuple[str, ...]
