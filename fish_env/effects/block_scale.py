"""Block scale: the stroke of the weight block is larger or smaller than commanded."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_block_displacement
from fish_env.model.jit import kernel


@kernel
def scale_displacement(inputs, time, fish, e):
    """dd -> scale dd."""
    return with_block_displacement(
        inputs, e.scale * inputs.block_displacement, e.scale * inputs.block_displacement_rate
    )


EFFECT = Effect(
    name="block_scale",
    section="actuation",
    summary="The weight block's stroke is larger or smaller than commanded.",
    equation="dd -> scale dd",
    source="Scale error of the crank-slider that moves the block",
    parameters=(
        EffectParameter("scale", "-", 1.0, 0.0, 3.0, (0.8, 1.2), "stroke over commanded stroke"),
    ),
    hooks={"inputs": scale_displacement},
    confusable_with=(
        "block_lag",
        "com_offset",
    ),
)
