"""Further physics of real robots: orbital waves, leaks, cables, walls, the surface, bubbles.

A wave is that of small-amplitude theory: an orbital flow, whose pressure gradient also pushes the
displaced mass. A leak adds mass where it gathers. A cable pulls only when it is taut, where it is
attached.
"""

from __future__ import annotations

import math

from tests.hidden.jit import helper
from tests.hidden.servo import TWO_PI
from tests.hidden.vectors import add, cross, scale, to_body, to_inertial

BENDING, BENDING_DAMPING = TWO_PI * 5.0, 0.3
"""rad/s and 1. How fast a body that bends before the tail follows the moment on it."""
TOP = -0.03
"""m. Where bubbles gather: above O_b."""
AIR = 10.3
"""m. Depth that doubles the pressure of the air."""


@helper
def orbital_wave(t, y, flow, rate, e):
    """Flow with the wave's, and the acceleration of the water there, inertial."""
    north, east = math.cos(e.wave_heading), math.sin(e.wave_heading)
    k, turn = e.wave_number, TWO_PI * e.wave_frequency
    depth = max(y[2], 0.0)
    falling, mirrored = math.exp(-k * depth), e.wave_mirror * math.exp(k * depth)
    size = e.wave_amplitude / (1.0 - e.wave_mirror)
    level, deep = size * (falling + mirrored), size * (falling - mirrored)
    theta = turn * t - k * (north * y[0] + east * y[1]) + e.wave_phase
    s, c = math.sin(theta), math.cos(theta)
    water = add(flow, (north * level * c, east * level * c, deep * s))
    # D/Dt of the phase and of the depth, along the water's own path.
    phase_rate = turn - k * (north * water[0] + east * water[1])
    sink = k * water[2]
    along = -level * phase_rate * s - deep * sink * c
    down = deep * phase_rate * c - level * sink * s
    return water, add(rate, (north * along, east * along, down))


@helper
def flooded(t, mass, centre, inertia, e):
    """Mass, centre of mass and inertia with the water that has come in."""
    water = e.water_ingress_rate * t
    total = mass + water
    place = (e.water_ingress_x, 0.0, 0.0)
    both = scale(1.0 / total, add(scale(mass, centre), scale(water, place)))
    across = water * e.water_ingress_x * e.water_ingress_x
    return total, both, (inertia[0], inertia[1] + across, inertia[2] + across)


@helper
def bend_body(y, dy, hinge, e):
    """The body gives way before the tail, as a spring with its own frequency."""
    if math.isinf(e.body_flexibility_stiffness):
        return
    dy[37] = y[38]
    pulled = hinge / e.body_flexibility_stiffness
    dy[38] = BENDING * BENDING * (pulled - y[37]) - 2.0 * BENDING_DAMPING * BENDING * y[38]


@helper
def drag_near_walls(y, e):
    """Share of drag that a wall and the floor add."""
    more = 0.0
    if e.wall_effect_gain != 0.0:
        along = y[0] * math.cos(e.wall_effect_heading) + y[1] * math.sin(e.wall_effect_heading)
        away = max(e.wall_effect_distance - along, 0.0)
        more += e.wall_effect_gain * math.exp(-away / e.wall_effect_range)
    if e.floor_effect_gain != 0.0:
        away = max(e.floor_effect_depth - y[2], 0.0)
        more += e.floor_effect_gain * math.exp(-away / e.floor_effect_range)
    return more


@helper
def surroundings(y, down, water_rate, fish, e, wrench):
    """Adds what the surroundings do; `down` is g and `water_rate` DU/Dt, both in the body frame."""
    if e.wave_amplitude != 0.0:
        for i in range(3):
            wrench[i] += fish.buoyancy * water_rate[i]
    if e.surface_piercing_height != 0.0:
        half = e.surface_piercing_height
        out = min(max((half - y[2]) / (2.0 * half), 0.0), 1.0)
        # A round back comes out slowly at first.
        lost = fish.buoyancy * out * out * (3.0 - 2.0 * out)
        for i in range(3):
            wrench[i] += lost * down[i]
    if e.bubbles_mass != 0.0:
        lift = scale(-e.bubbles_mass / (1.0 + max(y[2], 0.0) / AIR), down)
        push(wrench, lift, (e.bubbles_x, 0.0, TOP))
    if e.tether_stiffness != 0.0:
        cable(y, e, wrench)


@helper
def push(wrench, force, place):
    """Adds a force at a place."""
    moment = cross(place, force)
    for i in range(3):
        wrench[i] += force[i]
        wrench[3 + i] += moment[i]


@helper
def cable(y, e, wrench):
    """Adds the pull of a cable that is longer than its slack."""
    place = (e.tether_attach_x, 0.0, 0.0)
    end = to_inertial(y, place)
    reach = (y[0] + end[0] - e.tether_x, y[1] + end[1] - e.tether_y, y[2] + end[2] - e.tether_z)
    length = math.sqrt(reach[0] ** 2 + reach[1] ** 2 + reach[2] ** 2)
    if length > e.tether_slack and length > 0.0:
        pull = -e.tether_stiffness * (length - e.tether_slack) / length
        push(wrench, to_body(y, scale(pull, reach)), place)
