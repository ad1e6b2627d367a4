"""d/dt of the whole state: one 6 x 6 system for the accelerations of fish, water and cargo.

State: 0-2 position, 3-11 rotation matrix body to inertial by rows, 12-14 velocity and 15-17
angular velocity in the body frame, 18 lagged tail, 19-20 flexible tail, 21 lagged block,
22-24 remembered tail force, 25-26 sloshing water, 27-32 remembered wrench of the hull,
33-36 displacement and angle of the block that reacts, each with its rate, 37-38 bending of the
body before the tail, 39-42 joints of a tail of three links and their rates, 43-44 wake oscillator,
45 side of the wake.
"""

from __future__ import annotations

import math

from tests.hidden.foreign import foreign_wrench, slosh
from tests.hidden.hull import (
    block_place,
    centre_of_mass,
    damping_moment,
    extra_drag,
    hull_force,
    inertia_about_origin,
    rigid_matrix,
    weight,
)
from tests.hidden.jit import helper
from tests.hidden.plants import foreign_plants, linked_tail
from tests.hidden.servo import (
    AMPLITUDE,
    FREQUENCY,
    HINGE,
    OFFSET,
    block_motion,
    tail_motion,
)
from tests.hidden.surroundings import (
    bend_body,
    drag_near_walls,
    flooded,
    orbital_wave,
    surroundings,
)
from tests.hidden.tail import centre_of_pressure, reactive, steady_tail_force
from tests.hidden.vectors import add, cross, scale, solve6, to_body, to_inertial

STATES = 46
DRIVE_TIME = 0.02
"""s. How fast the block follows where nothing slower holds it back."""


@helper
def put(wrench, force, moment):
    for i in range(3):
        wrench[i] += force[i]
        wrench[3 + i] += moment[i]


@helper
def water_flow(t, y, rise, e):
    """Flow at the fish and its rate of change along the fish's path, inertial."""
    z = y[2]
    shear = e.shear_current_rate
    along = (math.cos(e.shear_current_heading), math.sin(e.shear_current_heading), 0.0)
    flow = add(
        (
            e.current_north,
            e.current_east,
            e.current_down,
        ),
        scale(shear * (z - e.shear_current_depth), along),
    )
    rate = scale(shear * rise, along)
    if e.wave_amplitude != 0.0:
        return orbital_wave(t, y, flow, rate, e)
    return flow, rate


@helper
def disturbance(t, y, e, push, wrench):
    """Adds the random push, straight between its samples."""
    place = (t - e.push_start) / e.push_step
    low = min(max(int(place), 0), push.shape[0] - 2)
    part = min(max(place - low, 0.0), 1.0)
    force = (0.0, 0.0, 0.0)
    moment = (0.0, 0.0, 0.0)
    for weight_, row in ((1.0 - part, low), (part, low + 1)):
        force = add(force, scale(weight_, (push[row, 0], push[row, 1], push[row, 2])))
        moment = add(moment, scale(weight_, (push[row, 3], push[row, 4], push[row, 5])))
    put(wrench, to_body(y, force) if e.push_inertial != 0.0 else force, moment)


@helper
def block_reaction(y, dy, shift, shift_rate, turn, spin, fish, e, wrench):
    """Adds what moving the block does to the hull: minus its mass times a + 2 w x v within it.

    A command that jumps would be an infinite force forth and back; the block that reacts follows
    the commanded place as fast as a good drive does, critically damped.
    """
    if e.block_reaction_scale == 0.0:
        return
    k = 1.0 / DRIVE_TIME
    run, swing = y[34], y[36]
    run_rate = 2.0 * k * (shift_rate - run) + k * k * (shift - y[33])
    swing_rate = -2.0 * k * swing + k * k * (turn - y[35])
    dy[33], dy[34], dy[35], dy[36] = run, run_rate, swing, swing_rate
    # The block circles the bracket's axis: tangent and radius of its place.
    tangent = (0.0, fish.d2 * math.cos(y[35]), -fish.d2 * math.sin(y[35]))
    radius = (0.0, fish.d2 * math.sin(y[35]), fish.d2 * math.cos(y[35]))
    v = add((-run, 0.0, 0.0), scale(swing, tangent))
    a = add((-run_rate, 0.0, 0.0), add(scale(swing_rate, tangent), scale(-swing * swing, radius)))
    push = -e.block_reaction_scale * fish.block_mass
    force = scale(push, add(a, scale(2.0, cross(spin, v))))
    put(wrench, force, cross(block_place(y[33], y[35], fish), force))


@helper
def added_mass(velocity, spin, drift, e, matrix, wrench):
    """Kirchhoff: minus the rate of the water's momentum, diagonal at O_b."""
    a = (e.added_mass_surge, e.added_mass_sway, e.added_mass_heave)
    i = (e.added_mass_roll, e.added_mass_pitch, e.added_mass_yaw)
    p = (a[0] * velocity[0], a[1] * velocity[1], a[2] * velocity[2])
    h = (i[0] * spin[0], i[1] * spin[1], i[2] * spin[2])
    late = (a[0] * drift[0], a[1] * drift[1], a[2] * drift[2])
    force = add(late, cross(spin, p))
    moment = add(cross(spin, h), cross(velocity, p))
    put(wrench, scale(-1.0, force), scale(-1.0, moment))
    for k in range(3):
        matrix[k, k] += a[k]
        matrix[3 + k, 3 + k] += i[k]


@helper
def remembered(y, dy, first, now, time_constant):
    """First-order lag of a vector kept in three states."""
    kept = (y[first], y[first + 1], y[first + 2])
    for i in range(3):
        dy[first + i] = (now[i] - kept[i]) / time_constant
    return kept


@helper
def water_wrench(y, dy, velocity, spin, angle, rate, row, fish, e, table, drive, wrench):
    """Adds all quasi-steady forces of the water."""
    tail = steady_tail_force(velocity, spin, angle, rate, fish, e)
    arm, place = centre_of_pressure(angle, fish)
    drive[HINGE] = arm[0] * tail[1] - arm[1] * tail[0]
    bend_body(y, dy, drive[HINGE], e)
    if e.linked_tail_share != 0.0:
        linked_tail(y, dy, velocity, spin, angle, rate, tail, place, fish, e, wrench)
    if e.wake_memory_time_constant > 0.0:
        tail = remembered(y, dy, 22, tail, e.wake_memory_time_constant)
    put(wrench, tail, cross(place, tail))
    force, moment = hull_force(velocity, y[2], drag_near_walls(y, e), fish, e)
    if e.hull_memory_time_constant > 0.0:
        force = remembered(y, dy, 27, force, e.hull_memory_time_constant)
        moment = remembered(y, dy, 30, moment, e.hull_memory_time_constant)
    put(wrench, force, moment)
    put(wrench, extra_drag(velocity, table[row, OFFSET], e), damping_moment(spin, fish, e))


@helper
def derivative(t, y, dy, row, late, fish, e, table, push, drive, matrix, wrench):
    dy[:] = 0.0
    ground = (y[12], y[13], y[14])
    spin = (y[15], y[16], y[17])
    path = to_inertial(y, ground)
    angle, rate, bend = tail_motion(t, y, dy, late, e, table, drive)
    angle, rate = angle + y[37], rate + y[38]
    shift, shift_rate, turn = block_motion(y, dy, row, e, table, drive)
    place = block_place(shift, turn, fish)
    centre = centre_of_mass(place, fish, e)
    inertia = inertia_about_origin(place, fish)
    mass = fish.mass
    if e.water_ingress_rate != 0.0:
        mass, centre, inertia = flooded(t, mass, centre, inertia, e)
    flow, flow_rate = water_flow(t, y, path[2], e)
    stream = to_body(y, flow)
    velocity = add(ground, scale(-1.0, stream))
    # d(V_rel)/dt - dV/dt: the flow seen from the turning body, and its own change.
    drift = add(cross(spin, stream), scale(-1.0, to_body(y, flow_rate)))

    rigid_matrix(centre, inertia, mass, matrix)
    wrench[:] = 0.0
    water_wrench(y, dy, velocity, spin, angle, rate, row, fish, e, table, drive, wrench)
    down = to_body(y, (0.0, 0.0, fish.gravity))
    force, moment = weight(down, y[2], mass, centre, fish, e)
    put(wrench, force, moment)
    surroundings(y, down, to_body(y, flow_rate), fish, e, wrench)
    foreign_plants(y, dy, velocity, spin, fish, e, wrench)
    disturbance(t, y, e, push, wrench)
    added_mass(velocity, spin, drift, e, matrix, wrench)
    if e.tail_reactive_scale != 0.0:
        reactive(velocity, spin, drift, angle, rate, bend, fish, e, matrix, wrench)
    block_reaction(y, dy, shift, shift_rate, turn, spin, fish, e, wrench)
    foreign_wrench(t, y, velocity, spin, table[row, AMPLITUDE] * table[row, FREQUENCY], e, drive,
                   wrench)  # fmt: skip
    slosh(y, dy, ground, spin, down, e, matrix, wrench)

    drive_out = (inertia[0] * spin[0], inertia[1] * spin[1], inertia[2] * spin[2])
    carried = cross(spin, add(ground, cross(spin, centre)))
    turned = add(cross(spin, drive_out), scale(mass, cross(centre, cross(spin, ground))))
    put(wrench, scale(-mass, carried), scale(-1.0, turned))
    solve6(matrix, wrench)

    for i in range(3):
        dy[i] = path[i]
        dy[12 + i] = wrench[i]
        dy[15 + i] = wrench[3 + i]
        across = cross((y[3 + 3 * i], y[4 + 3 * i], y[5 + 3 * i]), spin)
        for j in range(3):
            dy[3 + 3 * i + j] = across[j]
    if e.sloshing_mass != 0.0:
        dy[26] -= dy[12]
