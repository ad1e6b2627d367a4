"""How much a diagnosis spends: all it can, or a first look."""

from __future__ import annotations

from dataclasses import dataclass, replace


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
        pictured: most runs that the report shows, those kept for judging first.
        left_out: in words, what a full diagnosis does beyond this one.
    """

    runs: int
    seconds: float
    step_s: float
    shortlist: int
    finalists: int
    retries: bool
    pictured: int
    left_out: tuple[str, ...] = ()

    @property
    def reduced(self) -> Effort:
        """The same with fewer causes tried, one fitted, and what was found not questioned."""
        return replace(self, shortlist=3, finalists=1, retries=False)


PICTURES = "figures as PNG"
FULL = Effort(
    runs=10_000,
    seconds=float("inf"),
    step_s=0.01,
    shortlist=6,
    finalists=4,
    retries=True,
    pictured=6,
)
QUICK = Effort(
    runs=2,
    seconds=20.0,
    step_s=0.02,
    shortlist=3,
    finalists=1,
    retries=False,
    pictured=2,
    left_out=(
        "all but the first 20 s of two of the runs for fitting",
        "fits of rival causes, so nothing comes out as ambiguous",
        "second looks: from the winner, at tails out of step, for weaker causes, for chance",
        "a model of what no cause explains",
        "pictures of more than two runs, and the map of where the misfit sits",
        PICTURES,
    ),
)
TABLE_LEFT_OUT = (QUICK.left_out[1], "second looks: from the winner, for weaker causes", PICTURES)
"""What a first look at a table of averages leaves out: it uses all conditions."""


def effort_of(quick: bool) -> Effort:
    """What a first look spends, or a whole diagnosis."""
    return QUICK if quick else FULL
