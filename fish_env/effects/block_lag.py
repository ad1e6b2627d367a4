"""Block lag: the weight block follows its command as a first-order system."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_block_displacement
from fish_env.model.jit import kernel


@kernel
def lag_block(inputs, time, fish, e, states):
    """d(x)/dt = (dd - x) / T: position and rate of the block that the other terms see."""
    (position,) = states
    on = e.time_constant > 0.0
    rate = (inputs.block_displacement - position) / (e.time_constant if on else 1.0)
    seen = with_block_displacement(
        inputs,
        position if on else inputs.block_displacement,
        rate if on else inputs.block_displacement_rate,
    )
    return seen, (rate if on else 0.0,)


@kernel
def start_at_command(inputs, tail, fish, e):
    """The run starts with the block at its command."""
    return (inputs.block_displacement,)


def fastest(values):
    """Time constant of the lag; infinite when the effect is off."""
    return values["time_constant"] or float("inf")


EFFECT = Effect(
    name="block_lag",
    section="actuation",
    summary="The weight block approaches its command with a lag.",
    equation="d(x)/dt = (dd - x) / time_constant, the block being at x",
    source="First-order servo model, e.g. Ogata, Modern Control Engineering, section 5-2",
    parameters=(
        EffectParameter(
            "time_constant", "s", 0.0, 0.0, 10.0, (0.05, 1.0), "time to 63 % of a step"
        ),
    ),
    hooks={"inputs": lag_block},
    states={"inputs": ("position",)},
    initial_states=start_at_command,
    time_scale=fastest,
    order=1,
    confusable_with=(
        "block_reaction",
        "block_scale",
    ),
)
