"""From an attribution to one of the six verdicts."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.diagnosis.adequacy import Adequacy
from fish_env.diagnosis.attribution import Attribution
from fish_env.diagnosis.preconditions import Precondition

VERDICTS = (
    "no_misfit",
    "parameters",
    "cause",
    "ambiguous",
    "outside_library",
    "not_excited",
)


@dataclass(frozen=True)
class Verdict:
    """What the diagnosis says.

    Attributes:
        name: one of VERDICTS.
        causes: accepted causes.
        alternatives: other sets of causes that explain the data alike.
    """

    name: str
    causes: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, ...], ...] = ()


def decide(
    attribution: Attribution, adequacy: Adequacy, preconditions: tuple[Precondition, ...]
) -> Verdict:
    """Choose the verdict.

    Adequacy comes before naming: an explanation that does not reach the floor names nothing.
    """
    accepted = attribution.accepted
    if not adequacy.reached:
        return Verdict("outside_library")
    if accepted.causes:
        if attribution.rivals:
            others = tuple(rival.causes for rival in attribution.rivals)
            return Verdict("ambiguous", accepted.causes, others)
        effects = [name for name in accepted.causes if not name.startswith("parameter:")]
        return Verdict("cause" if effects else "parameters", accepted.causes)
    blind = sum(not p.excited for p in preconditions)
    if preconditions and blind > len(preconditions) / 2:
        return Verdict("not_excited")
    return Verdict("no_misfit")
