"""Servo rate limit: the tail's servo turns only so fast.

The tail's rate jumps where it meets its command again, and a fixed step that such a jump falls
into loses its order: the angles stay exact, the path is off by up to a tenth of the effect on it
at a step of 10 ms, by a twentieth at 5 ms.
"""

from __future__ import annotations

from math import inf

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import SETTLING_TIME, spread_jumps

ROUNDING = 1e-9  # rad; a tail this close to its command is on it


@kernel
def limit_rate(tail, inputs, phase, time, fish, e, states, memory, since):
    """The tail moves towards its command, by at most rate times the time since the last step.

    This is the exact solution of d(xi)/dt = clip(towards cmd, -rate, rate) while the command does
    not turn round within a step. On its command the tail has the command's rate.
    """
    (settled_rate,), (angle,) = states, memory
    on = e.rate < inf
    limit = e.rate if on else 1.0
    reach = limit * since
    gap = tail.angle - angle
    behind = abs(gap) > reach + ROUNDING
    towards = limit if gap > 0.0 else -limit
    rate = towards if behind else min(max(tail.rate, -limit), limit)
    limited, slope = spread_jumps(
        Tail(
            angle + min(max(gap, -reach), reach) if behind else tail.angle,
            rate,
            tail.acceleration if rate == tail.rate else 0.0,
        ),
        settled_rate,
    )
    seen = Tail(
        limited.angle if on else tail.angle,
        limited.rate if on else tail.rate,
        limited.acceleration if on else tail.acceleration,
    )
    return seen, (slope if on else 0.0,), (seen.angle,)


@kernel
def start_at_command(inputs, tail, fish, e):
    """The run starts with the tail where it is commanded, moving as fast as it can follow."""
    return min(max(tail.rate, -e.rate), e.rate), tail.angle


def fastest(values):
    """Jumps of the rate are spread over a fixed time."""
    return SETTLING_TIME if values["rate"] < inf else inf


EFFECT = Effect(
    name="servo_rate_limit",
    section="actuation",
    summary="Fast strokes become triangles: the tail falls short where its command is too quick.",
    equation="d(xi)/dt = clip(towards cmd, -rate, rate)",
    source="Speed limit of a servo motor at its supply voltage (60 deg in 0.1 to 0.4 s)",
    parameters=(
        EffectParameter("rate", "rad/s", inf, 0.01, inf, (2.0, 8.0), "largest rate of the tail"),
    ),
    hooks={"tail": limit_rate},
    states={"tail": ("settled_rate",)},
    memory={"tail": ("angle",)},
    initial_states=start_at_command,
    time_scale=fastest,
    order=4,
    step_error=0.025,
    confusable_with=(
        "servo_backlash",
        "servo_lag",
        "tail_gain",
    ),
)
