"""How much a diagnosis computes: all that is of use, quick mode, or without a limit."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fish_env.inference.policy import POLICY


@dataclass(frozen=True)
class Effort:
    """What is spent on one diagnosis of runs.

    Attributes:
        runs: most runs that are fitted.
        seconds: longest stretch of each, from its beginning.
        step_s: longest step of the simulation (s), but where it has to be finer.
        shortlist: effects tried at each step.
        finalists: of these, fitted in full.
        retries: whether what was found is questioned: other starts from where the winner is,
            tails out of step with their beat, weaker causes where something is missing, the final
            runs where that may be chance and nothing is named; and what no cause explains
            described.
        pictured: most runs that the report shows, held-out ones first.
        most_passes: how often all runs are simulated before no further search begins.
        left_out: in words, what a full diagnosis does beyond this one.
    """

    runs: int
    seconds: float
    step_s: float
    shortlist: int
    finalists: int
    retries: bool
    pictured: int
    most_passes: float = float("inf")
    left_out: tuple[str, ...] = ()

    @property
    def reduced(self) -> Effort:
        """The same with fewer causes tried, one fitted, and what was found not questioned."""
        few, fewest = POLICY.quick_shortlist, POLICY.quick_finalists
        return replace(self, shortlist=few, finalists=fewest, retries=False)


PICTURES = "figures as PNG"
FULL = Effort(
    runs=10_000,
    seconds=float("inf"),
    step_s=0.01,
    shortlist=POLICY.shortlist,
    finalists=POLICY.finalists,
    retries=True,
    pictured=6,
    most_passes=POLICY.most_passes,
)
PATIENT = replace(FULL, most_passes=float("inf"))
QUICK = Effort(
    runs=POLICY.quick_runs,
    seconds=POLICY.quick_run_s,
    step_s=0.02,
    shortlist=POLICY.quick_shortlist,
    finalists=POLICY.quick_finalists,
    retries=False,
    pictured=2,
    left_out=(
        "fitting more than the first 20 s of two runs",
        "comparison of rival causes, so no answer is ambiguous",
        "restarts from the best cause, and tests of phase, weaker causes and chance",
        "a model of the residual",
        "pictures of more than two runs, and the map of where the misfit sits",
        PICTURES,
    ),
)
CUT_SHORT = ("further searches for causes",)
"""What a diagnosis leaves out whose search was cut short."""
TABLE_LEFT_OUT = (QUICK.left_out[1], "restarts from the best cause, weaker causes", PICTURES)
"""What quick mode leaves out of a table of averages: it uses all conditions."""


def effort_of(quick: bool, patient: bool = False) -> Effort:
    """The effort of quick mode, which is never long, of a patient diagnosis, or of a full one."""
    if quick:
        return QUICK
    return PATIENT if patient else FULL
