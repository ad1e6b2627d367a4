"""Quadratic damping: a moment against rotation that grows with the square of its rate."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def damp_rotation(motion, tail, inputs, centre, fish, e):
    """-diag(roll, pitch, yaw) |omega| omega, component by component, about O_b."""
    return Wrench(
        0.0,
        0.0,
        0.0,
        -e.roll * abs(motion.p) * motion.p,
        -e.pitch * abs(motion.q) * motion.q,
        -e.yaw * abs(motion.r) * motion.r,
    )


def _coefficient(name: str, plausible: tuple[float, float]) -> EffectParameter:
    return EffectParameter(
        name, "N m s^2", 0.0, 0.0, 1.0, plausible, f"quadratic damping in {name}"
    )


EFFECT = Effect(
    name="quadratic_damping",
    section="hydrodynamics",
    summary="Fast rotation is damped more than slow rotation.",
    equation="M = -diag(roll, pitch, yaw) |omega| omega",
    source="Fossen, Handbook of Marine Craft, section 6.4: nonlinear damping",
    parameters=(
        _coefficient("roll", (0.0005, 0.02)),
        _coefficient("pitch", (0.001, 0.03)),
        _coefficient("yaw", (0.0005, 0.01)),
    ),
    hooks={"wrench": damp_rotation},
    confusable_with=(
        "added_mass",
        "cross_flow_drag",
    ),
)
