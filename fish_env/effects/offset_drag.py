"""Offset drag: a tail offset adds drag."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def brake(motion, tail, inputs, centre, fish, e):
    """-coefficient xi1_bar^2 V_x |V_x| forward, at O_b."""
    square = inputs.tail_offset * inputs.tail_offset
    return Wrench(-e.coefficient * square * motion.u * abs(motion.u), 0.0, 0.0, 0.0, 0.0, 0.0)


EFFECT = Effect(
    name="offset_drag",
    section="hydrodynamics",
    summary="The fish loses more speed in a turn than lift and drag of its tail explain.",
    equation="F_x = -coefficient xi1_bar^2 V_x |V_x|",
    source="Separated flow behind a deflected tail; Hoerner, Fluid-Dynamic Drag, section 8",
    parameters=(
        EffectParameter(
            "coefficient", "N s^2/m^2", 0.0, 0.0, 100.0, (1.0, 15.0), "drag at an offset of 1 rad"
        ),
    ),
    hooks={"wrench": brake},
    confusable_with=(
        "cross_flow_drag",
        "linear_drag",
        "offset_gain",
        "side_load",
        "surface_drag",
        "swing_loss",
    ),
)
