"""Kinds of compiled filters: which stages of effects each computes."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import replace

from fish_env.effects.extended import ExtendedModel
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.model.effect import LOAD, STAGES

LEAN = frozenset[str]()
KERNELS = (LEAN, frozenset({*STAGES, LOAD}))
"""Stages that are compiled together: none for a fish without effects, and all. The kernel of all
passes over effects that are off in a whole block of lanes (:mod:`fish_env.model.emit_blocks`)."""


def quickest(stages: AbstractSet[str]) -> frozenset[str]:
    """The smallest set of stages with a kernel of its own that holds some stages."""
    return next(kind for kind in KERNELS if stages <= kind)


def with_stages(model: ExtendedModel, stages: AbstractSet[str]) -> ExtendedModel:
    """A model that computes these stages only, and a wrench that is known."""
    declared = tuple(e for e in model.declared if e.needs <= stages)
    if APPLIED_WRENCH not in declared:
        declared = (*declared, APPLIED_WRENCH)
    return replace(model, declared=declared)
