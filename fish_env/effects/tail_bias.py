"""Tail bias: the tail's zero is not where the command's zero is."""

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
    summary="The tail's centre is off: the fish turns although it is told to swim straight.",
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
