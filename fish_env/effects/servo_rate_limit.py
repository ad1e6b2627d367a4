"""Servo rate limit: the tail's servo has a largest rate.

The tail's rate jumps when it meets its command again, and steps are parted there.
"""

from __future__ import annotations

from math import inf

from fish_env.model.corners import MEMORY, handed_on, starting
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.servo import chase, met_or_left
from fish_env.model.tail import SETTLING_TIME


@kernel
def limit_rate(tail, inputs, phase, time, fish, e, states, memory, since):
    """The tail moves towards its command, by at most rate times the time since the last part."""
    (settled_rate,) = states
    angle, _, _, side = memory
    on = e.rate < inf
    limit = e.rate if on else 1.0
    return handed_on(on, tail, chase(tail, limit, limit, angle, side, since), settled_rate, side)


@kernel
def turns(e):
    """Whether it is on."""
    return e.rate < inf


@kernel
def corner(tail, phase, later, later_phase, e, memory, length):
    """When the tail meets its command, or the command becomes too fast."""
    angle, rate, acceleration, _ = memory
    limit = e.rate if e.rate < inf else 1.0
    when, angle, side = met_or_left(tail, later, limit, angle, length)
    return when, (angle, rate, acceleration, side)


@kernel
def start_at_command(inputs, tail, fish, e):
    """The run starts with the tail at its command, at the commanded rate within the limit."""
    side = 1.0 if tail.rate > e.rate else (-1.0 if tail.rate < -e.rate else 0.0)
    return min(max(tail.rate, -e.rate), e.rate), *starting(tail.angle, tail, side)


def fastest(values):
    """Jumps of the rate are spread over a fixed time."""
    return SETTLING_TIME if values["rate"] < inf else inf


EFFECT = Effect(
    name="servo_rate_limit",
    section="actuation",
    summary="Fast strokes become triangular: the tail does not reach the commanded amplitude.",
    equation="d(xi)/dt = clip(towards cmd, -rate, rate)",
    source="Speed limit of a servo motor at its supply voltage (60 deg in 0.1 to 0.4 s)",
    parameters=(
        EffectParameter("rate", "rad/s", inf, 0.01, inf, (2.0, 8.0), "largest rate of the tail"),
    ),
    hooks={"tail": limit_rate},
    states={"tail": ("settled_rate",)},
    memory={"tail": MEMORY},
    initial_states=start_at_command,
    turns=turns,
    corner=corner,
    time_scale=fastest,
    order=4,
    confusable_with=(
        "servo_backlash",
        "servo_lag",
        "servo_torque_limit",
        "tail_gain",
    ),
)
