"""Kinds of compiled physics: which effects are computed together.

An effect costs a little where it is off too, so a fish runs on the smallest kind that holds all its
effects. The bits are the same in each. One kind for every set of effects would be compiled anew for
every fish.
"""

from __future__ import annotations

from collections.abc import Collection

from fish_env.effects.registry import catalogue
from fish_env.model.effect import Effect

STAGES_OF = {
    "inertia": {"inertia"},
    "tail": {"tail"},
    "commands": {"inputs"},
    "water": {"density", "barycentre", "water", "water_rate", "body_drag"},
}
"""Groups of effects, by stages of their hooks: each effect belongs to the first that has one. The
others are forces, but for effects that make the tail's rate jump, the group ``corners``."""
KINDS = (
    {"commands"},
    {"tail"},
    {"corners"},
    {"water"},
    {"forces"},
    {"inertia"},
    {"commands", "tail", "corners"},
    {"tail", "water"},
    {"water", "forces"},
)
"""Groups that are computed together, besides all of them: small kinds first."""


def group_of(effect: Effect) -> str:
    """The group of an effect on the motion."""
    if effect.corner is not None or effect.command_delay:
        return "corners"
    hooks = set(effect.hooks)
    return next((name for name, stages in STAGES_OF.items() if stages & hooks), "forces")


def together_with(names: Collection[str]) -> tuple[Effect, ...]:
    """The shipped effects on the motion in the smallest kind that has some of them.

    Loaded drives, which cost more than all others, are left out but for those named.

    Args:
        names: of the effects that have to be in; effects on records alone are passed over.

    Returns:
        Effects, in the order in which their hooks run.
    """
    moving = [e for e in catalogue().values() if e.acts_on_motion]
    wanted = {group_of(e) for e in moving if e.name in names}
    every = {group_of(e) for e in moving}
    kind = next((kind for kind in KINDS if wanted <= kind), every) if wanted else set()
    return tuple(e for e in moving if e.name in names or (group_of(e) in kind and not e.loaded))
