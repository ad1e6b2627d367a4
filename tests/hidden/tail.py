"""Forces of the water on the tail: lift and drag of a plate, and Lighthill's reactive force."""

from __future__ import annotations

import math

from tests.hidden.jit import helper
from tests.hidden.vectors import add, add_element, cross, dot, scale

# Three Gauss stations along the tail integrate the quadratic impulse exactly.
ROOT_06 = math.sqrt(0.6)


@helper
def plate(flow, normal, pressure_area, c0, c2, c1, drag_factor):
    """Drag and lift of a plate moving with `flow`; `pressure_area` is 1/2 rho S."""
    speed = math.sqrt(dot(flow, flow))
    if speed < 1e-15:
        return (0.0, 0.0, 0.0)
    direction = scale(1.0 / speed, flow)
    s = dot(normal, direction)
    q = pressure_area * speed * speed
    drag = scale(-q * (c0 + c2 * s * s) * drag_factor, direction)
    across = add(normal, scale(-s, direction))
    return add(drag, scale(-q * c1 * s, across))


@helper
def centre_of_pressure(angle, fish):
    """Arm of the tail and its place from O_b."""
    arm = (-fish.r_c * math.cos(angle), -fish.r_c * math.sin(angle), 0.0)
    return arm, add((fish.root_x, fish.root_y, fish.root_z), arm)


@helper
def steady_tail_force(velocity, spin, angle, rate, fish, e):
    """Quasi-steady force of the tail, body frame."""
    arm, place = centre_of_pressure(angle, fish)
    seen = (velocity[0] * (1.0 - e.wake_fraction_fraction), velocity[1], velocity[2])
    flow = add(add(seen, cross(spin, place)), scale(rate, cross((0.0, 0.0, 1.0), arm)))
    normal = (-math.sin(angle), math.cos(angle), 0.0)
    lift = fish.tail_c1
    if e.tail_stall_loss != 0.0:
        sine = abs(dot(flow, normal)) / max(math.sqrt(dot(flow, flow)), 1e-12)
        beyond = (math.asin(min(sine, 1.0)) - e.tail_stall_onset) / e.tail_stall_width
        lift *= 1.0 - e.tail_stall_loss / (1.0 + math.exp(-min(max(beyond, -50.0), 50.0)))
    half = 0.5 * fish.density * fish.tail_area
    force = plate(flow, normal, half, fish.tail_c0, fish.tail_c2, lift, 1.0)
    if e.thrust_loss_per_speed != 0.0:
        speed = math.sqrt(dot(velocity, velocity))
        force = scale(max(1.0 - e.thrust_loss_per_speed * speed, 0.2), force)
    return force


@helper
def reactive(velocity, spin, drift, angle, rate, bend, fish, e, matrix, wrench):
    """Adds the reactive force of a rigid tail: water thrown by its stations, and by its tip.

    A station carries the mass mu with the normal velocity w; the tail feels -d(mu w n)/dt there,
    its inertia goes into `matrix`. Behind the tip the momentum stays in the wake and the flow
    around it pulls: -m u w n + 1/2 m w^2 forward. `drift` is the part of the relative
    acceleration that is not the body's own.
    """
    length = 2.0 * fish.r_c
    depth = fish.tail_area / length
    per_length = e.tail_reactive_scale * fish.density * math.pi * depth * depth / 4.0
    aft = (-math.cos(angle), -math.sin(angle), 0.0)
    normal = (-math.sin(angle), math.cos(angle), 0.0)
    aft_rate = scale(-rate, normal)
    normal_rate = scale(rate, aft)
    root = (fish.root_x, fish.root_y, fish.root_z)
    for station in range(3):
        along = 0.5 * length * (1.0 + (station - 1) * ROOT_06)
        mass = per_length * length * (8.0 if station == 1 else 5.0) / 18.0
        place = add(root, scale(along, aft))
        place_rate = scale(along, aft_rate)
        v = add(add(velocity, cross(spin, place)), place_rate)
        w = dot(normal, v)
        # Acceleration of the station, body frame, without the body's own accelerations.
        swing = scale(along, add(scale(-bend, normal), scale(-rate, normal_rate)))
        v_rate = add(add(drift, cross(spin, place_rate)), swing)
        w_rate = dot(normal_rate, v) + dot(normal, v_rate)
        lever = cross(place, normal)
        lever_rate = add(cross(place_rate, normal), cross(place, normal_rate))
        force = add(
            add(scale(w_rate, normal), scale(w, normal_rate)), cross(spin, scale(w, normal))
        )
        moment = add(
            add(scale(w_rate, lever), scale(w, lever_rate)),
            add(cross(spin, scale(w, lever)), cross(velocity, scale(w, normal))),
        )
        for i in range(3):
            wrench[i] -= mass * force[i]
            wrench[3 + i] -= mass * moment[i]
        add_element(matrix, mass, normal, lever)
    tip = add(root, scale(length, aft))
    v = add(add(velocity, cross(spin, tip)), scale(length, aft_rate))
    w, u = dot(normal, v), -dot(aft, v)
    force = add(scale(-per_length * u * w, normal), scale(-0.5 * per_length * w * w, aft))
    moment = cross(tip, force)
    for i in range(3):
        wrench[i] += force[i]
        wrench[3 + i] += moment[i]
