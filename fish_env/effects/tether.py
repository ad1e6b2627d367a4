"""Tether: a cable pulls the fish to a point when it is longer than its slack length."""

from __future__ import annotations

import math

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.frames import to_body, to_inertial
from fish_env.model.jit import kernel
from fish_env.model.records import Vector
from fish_env.model.tail import wrench_at


@kernel
def pull(motion, tail, inputs, centre, fish, e):
    """-stiffness max(0, 1 - slack/L) d at the attachment, d = C_I + R r_a - anchor, L = |d|.

    r_a = (attach_x, 0, 0) (m, body), so the cable also turns the fish: M = r_a x F.
    """
    arm = to_inertial(motion.attitude, Vector(e.attach_x, 0.0, 0.0))
    x = motion.x + arm.x - e.x
    y = motion.y + arm.y - e.y
    z = motion.z + arm.z - e.z
    square = x * x + y * y + z * z
    length = math.sqrt(square) if square > 0.0 else 1.0
    taut = e.stiffness * max(1.0 - e.slack / length, 0.0)
    force = to_body(motion.attitude, Vector(-taut * x, -taut * y, -taut * z))
    return wrench_at(e.attach_x, 0.0, 0.0, force)


def _anchor(axis: str, way: str) -> EffectParameter:
    return EffectParameter(
        axis, "m", 0.0, -100.0, 100.0, (-2.0, 2.0), f"anchor, {way}", shapes=True
    )


EFFECT = Effect(
    name="tether",
    section="surroundings",
    summary="A force towards one point that grows with distance, at every heading.",
    equation=(
        "F = -R^T stiffness max(0, 1 - slack/L) d, M = r_a x F, d = C_I + R r_a - anchor, "
        "L = |d|, r_a = (attach_x, 0, 0)"
    ),
    source="Hooke's law for a cable that carries no compression; Irvine, Cable Structures, 1981",
    parameters=(
        EffectParameter("stiffness", "N/m", 0.0, 0.0, 20.0, (0.002, 0.1), "force per metre"),
        _anchor("x", "north"),
        _anchor("y", "east"),
        _anchor("z", "down"),
        EffectParameter(
            "slack",
            "m",
            0.0,
            0.0,
            100.0,
            (0.0, 1.0),
            "length beyond which it pulls",
            shapes=True,
            probed=False,
        ),
        EffectParameter(
            "attach_x",
            "m",
            0.0,
            -0.5,
            0.5,
            (-0.15, 0.15),
            "attachment ahead of O_b",
            shapes=True,
            probed=False,
        ),
    ),
    hooks={"wrench": pull},
    confusable_with=(
        "current",
        "hull_compression",
        "linear_drag",
        "position_scale",
        "wall_effect",
    ),
)
