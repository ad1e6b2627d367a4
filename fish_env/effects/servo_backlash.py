"""Servo backlash: play in the gears between the servo and the tail.

The tail stays at rest until the servo has taken up the play, and then moves with it. This "play"
operator is exact from step to step and needs no stiff contact force.

The tail's rate jumps when contact is made, and steps are parted there.
"""

from __future__ import annotations

from math import inf

from fish_env.model.corners import MEMORY, TOUCH, cubic, handed_on, rises, starting
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import SETTLING_TIME


@kernel
def within(angle, servo, half):
    """The angle, moved no further than into [servo - half, servo + half]."""
    return min(max(angle, servo - half), servo + half)


@kernel
def take_up_play(tail, inputs, phase, time, fish, e, states, memory, since):
    """The tail rests within the play, and moves with the servo while in contact."""
    (settled_rate,) = states
    angle, _, _, side = memory
    touching = side != 0.0
    moved = Tail(
        tail.angle - side * (0.5 * e.gap) if touching else angle,
        tail.rate if touching else 0.0,
        tail.acceleration if touching else 0.0,
    )
    return handed_on(e.gap > 0.0, tail, moved, settled_rate, side)


@kernel
def turns(e):
    """Whether it is on."""
    return e.gap > 0.0


@kernel
def corner(tail, phase, later, later_phase, e, memory, length):
    """When the servo has taken up the play, or turns back.

    The tail rests meanwhile (0), or moves with the servo: to positive angles (1), or back (-1).
    """
    half = 0.5 * e.gap
    remembered, rate, acceleration, _ = memory
    angle = within(remembered, tail.angle, half)
    ahead = tail.angle - angle
    pushed = (ahead >= half - TOUCH) & (tail.rate > 0.0)
    pulled = (ahead <= TOUCH - half) & (tail.rate < 0.0)
    side = 1.0 if pushed else (-1.0 if pulled else 0.0)
    _, b, c, d = cubic(tail, later, length)
    moving, way = side != 0.0, 1.0 if later.angle > angle else -1.0
    when = length * rises(
        -side * b if moving else way * ahead - half,
        -2.0 * side * c if moving else way * b,
        -3.0 * side * d if moving else way * c,
        0.0 if moving else way * d,
    )
    begun = tail.angle - side * half if moving else angle
    return when, (begun, rate, acceleration, side)


@kernel
def start_in_contact(inputs, tail, fish, e):
    """The run starts with the play taken up in the direction in which the servo turns."""
    half = 0.5 * e.gap
    side = 1.0 if tail.rate > 0.0 else (-1.0 if tail.rate < 0.0 else 0.0)
    return tail.rate, *starting(tail.angle - side * half, tail, side)


def fastest(values):
    """Jumps of the rate are spread over a fixed time."""
    return SETTLING_TIME if values["gap"] > 0.0 else inf


EFFECT = Effect(
    name="servo_backlash",
    section="actuation",
    summary="The tail rests at each reversal until the gears have taken up their play.",
    equation="xi = min(max(xi before, servo - gap/2), servo + gap/2)",
    source="Visintin, Differential Models of Hysteresis: the play operator",
    parameters=(
        EffectParameter("gap", "rad", 0.0, 0.0, 0.5, (0.01, 0.15), "whole play, from end to end"),
    ),
    hooks={"tail": take_up_play},
    states={"tail": ("settled_rate",)},
    memory={"tail": MEMORY},
    initial_states=start_in_contact,
    turns=turns,
    corner=corner,
    time_scale=fastest,
    order=6,
    confusable_with=(
        "servo_delay",
        "servo_rate_limit",
        "tail_gain",
    ),
)
