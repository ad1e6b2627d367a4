"""Kinds of compiled filters: which stages of effects each computes."""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from fish_env.model.effect import STAGES

LEAN = frozenset[str]()
KERNELS = (
    LEAN,
    frozenset({"inputs", "tail"}),
    frozenset(
        {"barycentre", "water", "water_rate", "tail_inflow", "tail_lift", "tail_force"}
        | {"body_drag", "wrench"}
    ),
    frozenset(STAGES),
)
"""Stages that are compiled together. An effect costs a little where it is neutral too, so one of
what drives the tail, or of what pushes the fish, is computed without the other kinds: the same
bits, in two thirds of the time."""


def quickest(stages: AbstractSet[str]) -> frozenset[str]:
    """The smallest set of stages with a kernel of its own that holds some stages."""
    return next(kind for kind in KERNELS if stages <= kind)
