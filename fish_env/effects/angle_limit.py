"""Angle limit: stops limit the tail angle on one side or on both.

The tail's rate jumps when it meets a stop. Within half a step of the jump, the rate is replaced by
its mean over one step about the present time. The steps then add up to the change of the angle.
"""

from __future__ import annotations

from math import inf

from fish_env.model.corners import UNTOLD_STEP, rate_against_stops
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail


@kernel
def stop_tail(tail, inputs, phase, time, fish, e, memory, since):
    """xi = min(max(cmd, lower), upper); at rest against a stop."""
    (step,) = memory
    held = (tail.angle < e.lower) | (tail.angle > e.upper)
    seen = Tail(
        min(max(tail.angle, e.lower), e.upper),
        rate_against_stops(tail, e.lower, e.upper, held, step),
        0.0 if held else tail.acceleration,
    )
    return seen, (since if since > 0.0 else step,)


@kernel
def start_anywhere(inputs, tail, fish, e):
    """The length of the step before a run is unknown."""
    return (UNTOLD_STEP,)


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
    memory={"tail": ("step",)},
    initial_states=start_anywhere,
    order=3,
    step_error=0.003,
    confusable_with=(
        "offset_gain",
        "swing_loss",
        "tail_gain",
    ),
)
