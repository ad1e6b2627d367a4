"""Tail bias: the zero of the tail differs from the zero of its command."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail


@kernel
def offset_tail(tail, inputs, phase, time, fish, e):
    """cmd + offset."""
    return Tail(tail.angle + e.offset, tail.rate, tail.acceleration)


EFFECT = Effect(
    name="tail_bias",
    section="actuation",
    summary="The tail has a constant offset: the fish turns when commanded to swim straight.",
    equation="cmd -> cmd + offset",
    source="A horn set a spline tooth off on the servo's shaft (25 teeth: 0.25 rad a tooth)",
    parameters=(
        EffectParameter("offset", "rad", 0.0, -1.0, 1.0, (-0.12, 0.12), "angle added to the tail"),
    ),
    hooks={"tail": offset_tail},
    order=2,
    confusable_with=(
        "com_offset",
        "gyro_bias",
        "offset_gain",
        "tail_asymmetry",
    ),
)
