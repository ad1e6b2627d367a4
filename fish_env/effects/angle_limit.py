"""Angle limit: stops limit the tail angle on one side or on both.

The tail's rate jumps when it meets a stop, and steps are parted there.
"""

from __future__ import annotations

from math import inf

from fish_env.model.corners import TOUCH, cubic, rises
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail


@kernel
def stop_tail(tail, inputs, phase, time, fish, e, memory, since):
    """xi = min(max(cmd, lower), upper); at rest against a stop."""
    (side,) = memory
    held = side != 0.0
    seen = Tail(
        (e.upper if side > 0.0 else e.lower) if held else tail.angle,
        0.0 if held else tail.rate,
        0.0 if held else tail.acceleration,
    )
    return seen, (side,)


@kernel
def turns(e):
    """Whether there is a stop."""
    return (e.lower > -inf) | (e.upper < inf)


@kernel
def corner(tail, phase, later, later_phase, e, memory, length):
    """When the tail meets a stop or leaves it: held by the upper (1), the lower (-1), or none."""
    a, b, c, d = cubic(tail, later, length)
    above = (a > e.upper + TOUCH) | ((a >= e.upper - TOUCH) & (b > 0.0))
    below = (a < e.lower - TOUCH) | ((a <= e.lower + TOUCH) & (b < 0.0))
    side = 1.0 if above else (-1.0 if below else 0.0)
    up = above | ((not below) & (later.angle > e.upper))
    way, stop = 1.0 if up == (side == 0.0) else -1.0, e.upper if up else e.lower
    return length * rises(way * (a - stop), way * b, way * c, way * d), (side,)


@kernel
def start_anywhere(inputs, tail, fish, e):
    """A stop holds the tail, or none."""
    return (1.0 if tail.angle > e.upper else (-1.0 if tail.angle < e.lower else 0.0),)


EFFECT = Effect(
    name="angle_limit",
    section="actuation",
    summary="Stops limit the tail angle on one side or on both.",
    equation="xi = min(max(cmd, lower), upper)",
    source="End stops of a servo or of the hull, and pulse widths that a servo cuts off",
    parameters=(
        EffectParameter("lower", "rad", -inf, -inf, 0.0, (-0.7, -0.2), "stop on the port side"),
        EffectParameter("upper", "rad", inf, 0.0, inf, (0.2, 0.7), "stop on the starboard side"),
    ),
    hooks={"tail": stop_tail},
    memory={"tail": ("side",)},
    initial_states=start_anywhere,
    turns=turns,
    corner=corner,
    order=3,
    confusable_with=(
        "offset_gain",
        "swing_loss",
        "tail_gain",
    ),
)
