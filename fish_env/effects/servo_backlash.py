"""Servo backlash: play in the gears between the servo and the tail.

The tail stays where it is until the servo has taken up the play, and then moves with it: the
"play" operator, which is exact from step to step and needs no stiff contact force.

The tail's rate jumps where the servo takes it along, and a fixed step that such a jump falls into
loses its order: the angles stay exact, forces that depend on the rate are off by a tenth to a half
of the effect's own share of them at a step of 10 ms, and by all of it for gaps below 0.03 rad.
"""

from __future__ import annotations

from math import inf

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import SETTLING_TIME, spread_jumps

ROUNDING = 1e-9  # rad; teeth this close touch


@kernel
def turning_point(tail, since):
    """The servo's angle where it last turned round, if that was within the present step."""
    turning = tail.acceleration != 0.0
    ago = tail.rate / (tail.acceleration if turning else 1.0)
    turned = turning & (ago > 0.0) & (ago < since)
    return tail.angle - 0.5 * tail.rate * ago if turned else tail.angle


@kernel
def within(angle, servo, half):
    """The angle, moved no further than into [servo - half, servo + half]."""
    return min(max(angle, servo - half), servo + half)


@kernel
def take_up_play(tail, inputs, phase, time, fish, e, states, memory, since):
    """xi = the old xi, moved no further than into [servo - gap/2, servo + gap/2]."""
    (settled_rate,), (angle,) = states, memory
    on = e.gap > 0.0
    half = 0.5 * e.gap
    turned_at = turning_point(tail, since)
    held = within(within(angle, turned_at, half), tail.angle, half)
    pushed = (held - ROUNDING < tail.angle - half) & (tail.rate > 0.0)
    pulled = (held + ROUNDING > tail.angle + half) & (tail.rate < 0.0)
    moves = pushed | pulled
    driven, slope = spread_jumps(
        Tail(held, tail.rate if moves else 0.0, tail.acceleration if moves else 0.0), settled_rate
    )
    seen = Tail(
        driven.angle if on else tail.angle,
        driven.rate if on else tail.rate,
        driven.acceleration if on else tail.acceleration,
    )
    return seen, (slope if on else 0.0,), (seen.angle,)


@kernel
def start_in_contact(inputs, tail, fish, e):
    """The run starts with the play taken up in the sense in which the servo turns."""
    half = 0.5 * e.gap
    behind = half if tail.rate > 0.0 else (-half if tail.rate < 0.0 else 0.0)
    return tail.rate, tail.angle - behind


def fastest(values):
    """Jumps of the rate are spread over a fixed time."""
    return SETTLING_TIME if values["gap"] > 0.0 else inf


EFFECT = Effect(
    name="servo_backlash",
    section="actuation",
    summary="The tail rests at every reversal while the gears take up their play.",
    equation="xi = min(max(xi before, servo - gap/2), servo + gap/2)",
    source="Visintin, Differential Models of Hysteresis: the play operator",
    parameters=(
        EffectParameter("gap", "rad", 0.0, 0.0, 0.5, (0.01, 0.15), "whole play, end to end"),
    ),
    hooks={"tail": take_up_play},
    states={"tail": ("settled_rate",)},
    memory={"tail": ("angle",)},
    initial_states=start_in_contact,
    time_scale=fastest,
    order=6,
    step_error=0.05,
    confusable_with=(
        "servo_delay",
        "servo_rate_limit",
        "tail_gain",
    ),
)
