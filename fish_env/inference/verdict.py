"""From an attribution to one of the verdicts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

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
        minor: causes of the extended model that are too small to be named.
        faint: causes of the extended model that may not act, if all else acts a little.
    """

    name: str
    causes: tuple[CauseId, ...] = ()
    alternatives: tuple[tuple[CauseId, ...], ...] = ()
    minor: tuple[CauseId, ...] = ()
    faint: tuple[CauseId, ...] = ()

    def named(self, causes: Sequence[CauseId]) -> tuple[CauseId, ...]:
        """Those of some causes that are neither too small nor too faint to be named."""
        return tuple(cause for cause in causes if cause not in (*self.minor, *self.faint))


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


def without_minor(
    verdict: Verdict, minor: Collection[CauseId] = (), faint: Collection[CauseId] = ()
) -> Verdict:
    """The verdict without the names of causes that are too small or too faint to be named.

    Explanations that differ from what is named in such causes alone are no alternatives. Where no
    certain cause would be left, the verdict stays as it is.

    Args:
        verdict: verdict that may name them.
        minor: causes that are too small.
        faint: causes that may not act.
    """
    quiet = replace(verdict, minor=(*verdict.minor, *minor), faint=(*verdict.faint, *faint))
    causes = quiet.named(verdict.causes)
    if not ((minor or faint) and causes):
        return verdict
    sets: dict[frozenset[CauseId], tuple[CauseId, ...]] = {}
    for alternative in map(quiet.named, verdict.alternatives):
        sets.setdefault(frozenset(alternative), alternative)
    alternatives = tuple(sets.values())
    if verdict.name == "partial":
        return replace(quiet, causes=causes, alternatives=alternatives if len(sets) > 1 else ())
    others = tuple(rest for rest in alternatives if not {*causes} <= {*rest})
    loud = verdict_of(True, causes, others, blind=False)
    return replace(loud, minor=quiet.minor, faint=quiet.faint)
