"""From an attribution to one of the verdicts."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.hypotheses import CauseId, Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.preconditions import Precondition

VERDICTS = (
    "inputs",
    "no_misfit",
    "parameters",
    "cause",
    "ambiguous",
    "partial",
    "outside_library",
    "not_excited",
)
EXTENDING = ("cause", "parameters", "ambiguous", "partial")
"""Verdicts that come with an extended model."""


@dataclass(frozen=True)
class Verdict:
    """What the diagnosis says.

    Attributes:
        name: one of VERDICTS.
        causes: accepted causes; of ``partial`` those that act for certain.
        alternatives: other sets of causes that explain the data alike; of ``partial`` all such
            sets, that of the extended model first.
    """

    name: str
    causes: tuple[CauseId, ...] = ()
    alternatives: tuple[tuple[CauseId, ...], ...] = ()


def decide(
    attribution: Attribution, adequacy: Adequacy, preconditions: tuple[Precondition, ...]
) -> Verdict:
    """Choose the verdict.

    Adequacy comes before naming: an explanation that does not reach the floor names nothing.
    """
    blind = sum(not p.excited for p in preconditions)
    return verdict_of(
        adequacy.reached,
        attribution.accepted.causes,
        tuple(rival.causes for rival in attribution.rivals),
        blind > POLICY.most_blind_share * len(preconditions),
    )


def verdict_of(
    reached: bool,
    causes: tuple[CauseId, ...],
    rivals: tuple[tuple[CauseId, ...], ...],
    blind: bool,
) -> Verdict:
    """The verdict, given whether the floor is reached, what explains, and whether data are blind.

    Args:
        reached: the explanation leaves nothing but noise.
        causes: those accepted; none where the baseline explains all.
        rivals: other explanations that fit alike.
        blind: the data could not have shown most causes.
    """
    if not reached:
        return Verdict("outside_library")
    if causes and rivals:
        return Verdict("ambiguous", causes, rivals)
    if causes:
        effects = [cause for cause in causes if not isinstance(cause, Coefficient)]
        return Verdict("cause" if effects else "parameters", causes)
    return Verdict("not_excited" if blind else "no_misfit")
