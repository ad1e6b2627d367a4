"""Wake memory: lift and drag of the tail take time to follow its motion.

Each component of the force is filtered in the body frame, which turns little within the time
constant.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector


@kernel
def lag_force(force, motion, tail, fish, e, states):
    """dF/dt = (quasi-steady force - F) / T, component by component in the body frame."""
    x, y, z = states
    on = e.time_constant > 0.0
    per_second = 1.0 / e.time_constant if on else 0.0
    slopes = ((force.x - x) * per_second, (force.y - y) * per_second, (force.z - z) * per_second)
    return Vector(x if on else force.x, y if on else force.y, z if on else force.z), slopes


@kernel
def start_without_wake(inputs, tail, fish, e):
    """The run starts without a wake, so the filtered force is zero."""
    return 0.0, 0.0, 0.0


def fastest(values):
    """Time constant of the lag; infinite when the effect is off."""
    return values["time_constant"] or float("inf")


EFFECT = Effect(
    name="wake_memory",
    section="hydrodynamics",
    summary="The force of the tail lags its motion, because the wake needs time to form.",
    equation="dF/dt = (quasi-steady F - F) / time_constant, each body component",
    source="Wagner's lift build-up as a first-order lag, Fung, Theory of Aeroelasticity, 6.7",
    parameters=(
        EffectParameter("time_constant", "s", 0.0, 0.0, 2.0, (0.01, 0.2), "time to 63 % of a step"),
    ),
    hooks={"tail_force": lag_force},
    states={"tail_force": ("x", "y", "z")},
    initial_states=start_without_wake,
    time_scale=fastest,
    confusable_with=(
        "added_mass",
        "sensor_delay",
        "servo_delay",
        "servo_lag",
        "tail_flexibility",
        "tail_reactive",
    ),
)
