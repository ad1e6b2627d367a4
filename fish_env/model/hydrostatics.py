"""Gravity and buoyancy (paper section III.C.3)."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Vector, Wrench


@kernel
def gravity_wrench(attitude, centre, fish):
    """F_g = m_total R^T g (N, body), M_g = C_m x F_g about O_b."""
    weight = centre.mass * fish.gravity
    fx = weight * attitude.zx
    fy = weight * attitude.zy
    fz = weight * attitude.zz
    return Wrench(
        fx,
        fy,
        fz,
        centre.y * fz - centre.z * fy,
        centre.z * fx - centre.x * fz,
        centre.x * fy - centre.y * fx,
    )


@kernel
def buoyancy_force(attitude, centre, fish):
    """F_b = -m_b R^T g (N, body), acting at O_b."""
    lift = -centre.buoyancy_mass * fish.gravity
    return Vector(lift * attitude.zx, lift * attitude.zy, lift * attitude.zz)
