"""Tether: a cable pulls the fish back to a point."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.frames import to_body
from fish_env.model.jit import kernel
from fish_env.model.records import Vector, Wrench


@kernel
def pull(motion, tail, inputs, centre, fish, e):
    """-stiffness (C_I - anchor), inertial, at O_b."""
    inertial = Vector(
        -e.stiffness * (motion.x - e.x),
        -e.stiffness * (motion.y - e.y),
        -e.stiffness * (motion.z - e.z),
    )
    force = to_body(motion.attitude, inertial)
    return Wrench(force.x, force.y, force.z, 0.0, 0.0, 0.0)


def _anchor(axis: str, way: str) -> EffectParameter:
    return EffectParameter(
        axis, "m", 0.0, -100.0, 100.0, (-2.0, 2.0), f"anchor, {way}", shapes=True
    )


EFFECT = Effect(
    name="tether",
    section="surroundings",
    summary="A pull that grows with the distance from one place, whatever the heading.",
    equation="F = -R^T stiffness (C_I - anchor)",
    source="Hooke's law for a slack cable or umbilical",
    parameters=(
        EffectParameter("stiffness", "N/m", 0.0, 0.0, 20.0, (0.002, 0.1), "pull a metre"),
        _anchor("x", "north"),
        _anchor("y", "east"),
        _anchor("z", "down"),
    ),
    hooks={"wrench": pull},
    confusable_with=(
        "current",
        "hull_compression",
        "linear_drag",
        "position_scale",
    ),
)
