"""Weight block, barycentre and inertia (paper: figure 1(b), figure 4, equations of C_w, C_m, J)."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Barycentre, Inertia
from fish_env.model.trigonometry import sincos


@kernel
def barycentre(inputs, fish):
    """Mass properties with the block where its actuators hold it, quasi-statically.

    C_w = [a_rb + d1 - (s_w0 + dd - d3), b_rb + d2 sin xi2, c_rb + d2 cos xi2] (m, body);
    C_m = (M_ew + m_w C_w) / m_total; J = J_ew + J'_w + m_w r(C_w)^2 (kg m^2, about O_b, diagonal).
    """
    sine, cosine = sincos(inputs.block_angle)
    stroke = fish.s_w0 + inputs.block_displacement - fish.d3
    block_x = fish.bracket_x + fish.d1 - stroke
    block_y = fish.bracket_y + fish.d2 * sine
    block_z = fish.bracket_z + fish.d2 * cosine
    xx = block_x * block_x
    yy = block_y * block_y
    zz = block_z * block_z
    return Barycentre(
        fish.mass_total,
        fish.inverse_mass,
        fish.mass_buoyancy,
        (fish.static_x + fish.mass_block * block_x) * fish.inverse_mass,
        (fish.static_y + fish.mass_block * block_y) * fish.inverse_mass,
        (fish.static_z + fish.mass_block * block_z) * fish.inverse_mass,
        fish.inertia_rest_ob_x + fish.inertia_block_x + fish.mass_block * (yy + zz),
        fish.inertia_rest_ob_y + fish.inertia_block_y + fish.mass_block * (xx + zz),
        fish.inertia_rest_ob_z + fish.inertia_block_z + fish.mass_block * (xx + yy),
    )


@kernel
def rigid_inertia(centre):
    """6x6 mass matrix about O_b: [[m I, -m S(C_m)], [m S(C_m), J]], S(c) v = c x v."""
    mx = centre.mass * centre.x
    my = centre.mass * centre.y
    mz = centre.mass * centre.z
    return Inertia(
        centre.mass,
        0.0,
        centre.mass,
        0.0,
        0.0,
        centre.mass,
        0.0,
        -mz,
        my,
        centre.jx,
        mz,
        0.0,
        -mx,
        0.0,
        centre.jy,
        -my,
        mx,
        0.0,
        0.0,
        0.0,
        centre.jz,
    )


@kernel
def with_buoyancy(centre, buoyancy_mass):
    """The same mass properties with another displaced mass (kg)."""
    return Barycentre(
        centre.mass,
        centre.inverse_mass,
        buoyancy_mass,
        centre.x,
        centre.y,
        centre.z,
        centre.jx,
        centre.jy,
        centre.jz,
    )


@kernel
def with_load(centre, load, x, on):
    """The same mass properties with a point mass at (x, 0, 0), if it is there.

    Args:
        centre: mass properties without it.
        load: its mass (kg).
        x: its place ahead of O_b (m, body).
        on: whether it is there; else the mass properties are left as they are, to the last bit.
    """
    mass = centre.mass + load
    inverse = 1.0 / mass
    across = load * x * x
    return Barycentre(
        mass if on else centre.mass,
        inverse if on else centre.inverse_mass,
        centre.buoyancy_mass,
        (centre.mass * centre.x + load * x) * inverse if on else centre.x,
        centre.mass * centre.y * inverse if on else centre.y,
        centre.mass * centre.z * inverse if on else centre.z,
        centre.jx,
        centre.jy + across if on else centre.jy,
        centre.jz + across if on else centre.jz,
    )


@kernel
def with_offset(centre, x, y, z):
    """The same mass properties with the barycentre displaced (m, body)."""
    return Barycentre(
        centre.mass,
        centre.inverse_mass,
        centre.buoyancy_mass,
        centre.x + x,
        centre.y + y,
        centre.z + z,
        centre.jx,
        centre.jy,
        centre.jz,
    )


@kernel
def add_rank_one(inertia, factor, a, b):
    """inertia + factor (a b^T + b a^T) / 2 for two 6-vectors given as wrenches."""
    half = 0.5 * factor
    return Inertia(
        inertia.m00 + half * (a.fx * b.fx + b.fx * a.fx),
        inertia.m10 + half * (a.fy * b.fx + b.fy * a.fx),
        inertia.m11 + half * (a.fy * b.fy + b.fy * a.fy),
        inertia.m20 + half * (a.fz * b.fx + b.fz * a.fx),
        inertia.m21 + half * (a.fz * b.fy + b.fz * a.fy),
        inertia.m22 + half * (a.fz * b.fz + b.fz * a.fz),
        inertia.m30 + half * (a.mx * b.fx + b.mx * a.fx),
        inertia.m31 + half * (a.mx * b.fy + b.mx * a.fy),
        inertia.m32 + half * (a.mx * b.fz + b.mx * a.fz),
        inertia.m33 + half * (a.mx * b.mx + b.mx * a.mx),
        inertia.m40 + half * (a.my * b.fx + b.my * a.fx),
        inertia.m41 + half * (a.my * b.fy + b.my * a.fy),
        inertia.m42 + half * (a.my * b.fz + b.my * a.fz),
        inertia.m43 + half * (a.my * b.mx + b.my * a.mx),
        inertia.m44 + half * (a.my * b.my + b.my * a.my),
        inertia.m50 + half * (a.mz * b.fx + b.mz * a.fx),
        inertia.m51 + half * (a.mz * b.fy + b.mz * a.fy),
        inertia.m52 + half * (a.mz * b.fz + b.mz * a.fz),
        inertia.m53 + half * (a.mz * b.mx + b.mz * a.mx),
        inertia.m54 + half * (a.mz * b.my + b.mz * a.my),
        inertia.m55 + half * (a.mz * b.mz + b.mz * a.mz),
    )
