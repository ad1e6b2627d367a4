"""Lift and drag of a plate in a flow: the law that the tail and both body planes share."""

from __future__ import annotations

import math

from fish_env.model.jit import kernel
from fish_env.model.records import Vector


@kernel
def speed_and_inverse(x, y, z):
    """|v| (m/s) and 1/|v|, the latter zero at rest, where every force it enters is zero too."""
    square = x * x + y * y + z * z
    speed = math.sqrt(square)
    return speed, (1.0 / speed if speed > 0.0 else 0.0)


@kernel
def drag_force(velocity, speed, scale, coefficient):
    """-1/2 rho S C_D |v| v (N, frame of the velocity); scale = 1/2 rho S (kg/m)."""
    factor = -scale * coefficient * speed
    return Vector(factor * velocity.x, factor * velocity.y, factor * velocity.z)


@kernel
def lift_force(velocity, normal, speed, s, scale, coefficient):
    """-1/2 rho S |v| L (|v| n - s v) (N): along the part of -sign(s) n perpendicular to v.

    s = n . v/|v|, L = C_L sign(s)/cos(alpha) (see coefficients), scale = 1/2 rho S (kg/m).
    """
    factor = -scale * coefficient * speed
    return Vector(
        factor * (speed * normal.x - s * velocity.x),
        factor * (speed * normal.y - s * velocity.y),
        factor * (speed * normal.z - s * velocity.z),
    )
