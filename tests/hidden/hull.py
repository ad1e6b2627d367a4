"""Mass, weight, and the forces of the water on the hull."""

from __future__ import annotations

import math

from tests.hidden.jit import helper
from tests.hidden.tail import plate
from tests.hidden.vectors import add, cross, dot, scale


@helper
def block_place(shift, turn, fish):
    """Centre of the weight block, body frame."""
    return (
        fish.bracket_x + fish.d1 - (fish.s_w0 + shift - fish.d3),
        fish.bracket_y + fish.d2 * math.sin(turn),
        fish.bracket_z + fish.d2 * math.cos(turn),
    )


@helper
def centre_of_mass(place, fish, e):
    static = (fish.static_x, fish.static_y, fish.static_z)
    centre = scale(1.0 / fish.mass, add(static, scale(fish.block_mass, place)))
    return add(centre, (e.com_offset_x, e.com_offset_y, e.com_offset_z))


@helper
def from_axes(a):
    """Squared distance from each axis."""
    return a[1] * a[1] + a[2] * a[2], a[0] * a[0] + a[2] * a[2], a[0] * a[0] + a[1] * a[1]


@helper
def inertia_about_origin(place, fish):
    """Diagonal of J about O_b."""
    rest_mass = fish.mass - fish.block_mass
    static = (fish.static_x, fish.static_y, fish.static_z)
    rest = from_axes(scale(1.0 / rest_mass, static))
    block = from_axes(place)
    return (
        fish.rest_inertia_x
        + fish.block_inertia_x
        + rest_mass * rest[0]
        + fish.block_mass * block[0],
        fish.rest_inertia_y
        + fish.block_inertia_y
        + rest_mass * rest[1]
        + fish.block_mass * block[1],
        fish.rest_inertia_z
        + fish.block_inertia_z
        + rest_mass * rest[2]
        + fish.block_mass * block[2],
    )


@helper
def rigid_matrix(centre, inertia, mass, matrix):
    """Writes [[m I, -m [C]x], [m [C]x, J]]."""
    matrix[:, :] = 0.0
    for i in range(3):
        matrix[i, i] = mass
        matrix[3 + i, 3 + i] = inertia[i]
    for i, j, value in ((0, 4, 2), (1, 5, 0), (2, 3, 1)):
        matrix[i, j] = mass * centre[value]
        matrix[j, i] = mass * centre[value]
    for i, j, value in ((0, 5, 1), (1, 3, 2), (2, 4, 0)):
        matrix[i, j] = -mass * centre[value]
        matrix[j, i] = -mass * centre[value]


@helper
def plane_force(flow, normal, fish, c0, c2, c1, k, drag_factor):
    """Force of one plane and its signed impact moment."""
    speed2 = dot(flow, flow)
    if speed2 < 1e-30:
        return (0.0, 0.0, 0.0), 0.0
    area = (
        fish.area_x * flow[0] ** 2 + fish.area_y * flow[1] ** 2 + fish.area_z * flow[2] ** 2
    ) / speed2
    s = dot(normal, flow) / math.sqrt(speed2)
    half = 0.5 * fish.density * area
    force = plate(flow, normal, half, c0, c2, c1, drag_factor)
    return force, half * speed2 * k * s * math.sqrt(max(1.0 - s * s, 0.0))


@helper
def hull_force(velocity, depth, more, fish, e):
    """Force and moment of both planes, V the velocity through the water.

    `more` is the share of drag that walls add.
    """
    factor = 1.0 + more
    if e.surface_drag_gain != 0.0:
        factor += e.surface_drag_gain * math.exp(-depth / e.surface_drag_depth)
    vertical, pitching = plane_force(
        (velocity[0], 0.0, velocity[2]),
        (0.0, 0.0, 1.0),
        fish,
        fish.xz_c0,
        fish.xz_c2,
        fish.xz_c1,
        fish.xz_k,
        factor,
    )
    level, yawing = plane_force(
        (velocity[0], velocity[1], 0.0),
        (0.0, 1.0, 0.0),
        fish,
        fish.xy_c0,
        fish.xy_c2,
        fish.xy_c1,
        fish.xy_k,
        factor,
    )
    return add(vertical, level), (0.0, pitching, yawing)


@helper
def damping_moment(spin, fish, e):
    """Linear damping of the baseline and the quadratic one."""
    return (
        (fish.damping_x - e.quadratic_damping_roll * abs(spin[0])) * spin[0],
        (fish.damping_y - e.quadratic_damping_pitch * abs(spin[1])) * spin[1],
        (fish.damping_z - e.quadratic_damping_yaw * abs(spin[2])) * spin[2],
    )


@helper
def extra_drag(velocity, offset, e):
    """Drags that the baseline has not: linear, cross-flow, of a deflected tail."""
    u, v, w = velocity
    return (
        -e.linear_drag_surge * u - e.offset_drag_coefficient * offset * offset * u * abs(u),
        -e.linear_drag_sway * v - e.cross_flow_drag_sway * v * abs(v),
        -e.linear_drag_heave * w - e.cross_flow_drag_heave * w * abs(w),
    )


@helper
def weight(down, depth, mass, centre, fish, e):
    """Force and moment of gravity and buoyancy; `down` is g in the body frame."""
    displaced = fish.buoyancy + e.buoyancy_offset_mass - e.hull_compression_rate * depth
    if e.thermocline_mass != 0.0:
        below = math.tanh((depth - e.thermocline_depth) / e.thermocline_width)
        displaced += e.thermocline_mass * below
    heavy = scale(mass, down)
    return add(heavy, scale(-displaced, down)), cross(centre, heavy)
