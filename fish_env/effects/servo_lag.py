"""Servo lag: the tail follows its command as a first-order system."""

from __future__ import annotations

from math import inf

from fish_env.model.corners import followed
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail


@kernel
def lag_tail(tail, inputs, phase, time, fish, e, states):
    """d(xi)/dt = (cmd - xi) / T, and its derivative for the tail's acceleration."""
    (angle,) = states
    on = e.time_constant > 0.0
    per_second = 1.0 / (e.time_constant if on else 1.0)
    rate = (tail.angle - angle) * per_second
    acceleration = (tail.rate - rate) * per_second
    seen = Tail(
        angle if on else tail.angle,
        rate if on else tail.rate,
        acceleration if on else tail.acceleration,
    )
    return seen, (rate if on else 0.0,)


@kernel
def turns(e):
    """Whether it is on."""
    return e.time_constant > 0.0


@kernel
def settling(tail, e, states):
    """A jump of the command makes the tail fast for a few time constants."""
    (angle,) = states
    on = e.time_constant > 0.0
    rate = (tail.angle - angle) / (e.time_constant if on else 1.0)
    excess = abs(rate - tail.rate + e.time_constant * tail.acceleration)
    return followed(e.time_constant, excess) if on else inf


@kernel
def start_at_command(inputs, tail, fish, e):
    """The run starts with the tail at its command."""
    return (tail.angle,)


def fastest(values):
    """Time constant of the lag; infinite when the effect is off."""
    return values["time_constant"] or float("inf")


EFFECT = Effect(
    name="servo_lag",
    section="actuation",
    summary="The tail lags its command: it loses more amplitude and phase at higher frequency.",
    equation="d(xi)/dt = (cmd - xi) / time_constant",
    source="First-order servo model, e.g. Ogata, Modern Control Engineering, section 5-2",
    parameters=(
        EffectParameter(
            "time_constant", "s", 0.0, 0.0, 1.0, (0.01, 0.15), "time to 63 % of a step"
        ),
    ),
    hooks={"tail": lag_tail},
    states={"tail": ("angle",)},
    initial_states=start_at_command,
    turns=turns,
    settling=settling,
    time_scale=fastest,
    order=5,
    confusable_with=(
        "body_flexibility",
        "sensor_delay",
        "servo_delay",
        "servo_rate_limit",
        "servo_torque_limit",
        "tail_flexibility",
        "tail_gain",
        "wake_memory",
    ),
)
