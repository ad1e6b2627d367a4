"""Water and bodies of another kind: what neither the catalogue nor simple functions describe.

A tail of three links, of which two give way; a hull of strips that stall one by one (slender-body
strips with cross-flow); a wake that sheds vortices at a frequency of its own (van der Pol, as for
bluff bodies); a hull with a memory: its wake leans to one side until it is pushed to the other (as
behind bodies of revolution and vehicles), and lifts to that side meanwhile.
"""

from __future__ import annotations

import math

from tests.hidden.jit import helper
from tests.hidden.servo import TWO_PI
from tests.hidden.tail import plate
from tests.hidden.vectors import add, cross, scale

LINK_INERTIA, LINK_DAMPING = 4e-5, 0.25
"""kg m^2 with the water it carries, and the share of critical damping of a joint."""
STRIPS, FRONT, LENGTH, WIDTH = 8, 0.13, 0.26, 0.07
"""Strips of the hull; m: its front, length and width."""
STROUHAL, GROWTH = 0.2, 0.3
LEANING, PUSHED = 1.5, 30.0
"""s, and s/m: how slowly the wake changes sides, and how much a sway pushes it."""


@helper
def link_force(velocity, spin, joint, joint_rate, angle, rate, length, fish):
    """Force of one link, its centre and its far end with the end's velocity, body frame."""
    aft = (-math.cos(angle), -math.sin(angle), 0.0)
    normal = (-math.sin(angle), math.cos(angle), 0.0)
    centre = add(joint, scale(0.5 * length, aft))
    swing = add(joint_rate, scale(-0.5 * length * rate, normal))
    flow = add(add(velocity, cross(spin, centre)), swing)
    half = 0.5 * fish.density * fish.tail_area / 3.0
    force = plate(flow, normal, half, fish.tail_c0, fish.tail_c2, fish.tail_c1, 1.0)
    end = add(joint, scale(length, aft))
    return force, centre, end, add(joint_rate, scale(-length * rate, normal))


@helper
def hinge_moment(force, place, joint):
    return (place[0] - joint[0]) * force[1] - (place[1] - joint[1]) * force[0]


@helper
def joint_motion(y, dy, k, moment, stiffness):
    """A joint with a spring and a damper; angles at y[39 + k], rates at y[41 + k]."""
    damping = 2.0 * LINK_DAMPING * math.sqrt(stiffness * LINK_INERTIA)
    dy[39 + k] = y[41 + k]
    dy[41 + k] = (moment - stiffness * y[39 + k] - damping * y[41 + k]) / LINK_INERTIA


@helper
def linked_tail(y, dy, velocity, spin, angle, rate, tail, place, fish, e, wrench):
    """Adds a share of what three links do more than the one plate with force `tail` at `place`."""
    length = 2.0 * fish.r_c / 3.0
    root = (fish.root_x, fish.root_y, fish.root_z)
    still = (0.0, 0.0, 0.0)
    first, at1, knee, knee_rate = link_force(velocity, spin, root, still, angle, rate, length, fish)
    angle2, rate2 = angle + y[39], rate + y[41]
    second, at2, ankle, ankle_rate = link_force(
        velocity, spin, knee, knee_rate, angle2, rate2, length, fish
    )
    third, at3, _, _ = link_force(
        velocity, spin, ankle, ankle_rate, angle2 + y[40], rate2 + y[42], length, fish
    )
    at_knee = hinge_moment(second, at2, knee) + hinge_moment(third, at3, knee)
    joint_motion(y, dy, 0, at_knee, e.linked_tail_stiffness)
    joint_motion(y, dy, 1, hinge_moment(third, at3, ankle), e.linked_tail_stiffness)
    force = add(add(first, second), add(third, scale(-1.0, tail)))
    moment = add(
        add(cross(at1, first), cross(at2, second)),
        add(cross(at3, third), scale(-1.0, cross(place, tail))),
    )
    for i in range(3):
        wrench[i] += e.linked_tail_share * force[i]
        wrench[3 + i] += e.linked_tail_share * moment[i]


@helper
def strip_hull(velocity, spin, e, fish, wrench):
    """Adds strips that feel their own cross-flow, and lose their force beyond an incidence."""
    u, v, w = velocity
    for i in range(STRIPS):
        x = FRONT - LENGTH * (i + 0.5) / STRIPS
        side, heave = v + spin[2] * x, w - spin[1] * x
        across = math.sqrt(side * side + heave * heave)
        beyond = (math.atan2(across, abs(u) + 1e-9) - e.strip_hull_onset) / 0.08
        kept = 1.0 / (1.0 + math.exp(min(max(beyond, -50.0), 50.0)))
        speed = math.sqrt(u * u + across * across)
        size = -0.5 * fish.density * WIDTH * LENGTH / STRIPS * e.strip_hull_coefficient
        lift = (0.0, size * kept * speed * side, size * kept * speed * heave)
        moment = cross((x, 0.0, 0.0), lift)
        for k in range(3):
            wrench[k] += lift[k]
            wrench[3 + k] += moment[k]


@helper
def foreign_plants(y, dy, velocity, spin, fish, e, wrench):
    """Adds the forces of the hull's foreign physics."""
    if e.strip_hull_coefficient != 0.0:
        strip_hull(velocity, spin, e, fish, wrench)
    if e.wake_oscillator_lift != 0.0:
        u = velocity[0]
        turn = TWO_PI * STROUHAL * max(abs(u), 0.02) / WIDTH
        dy[43] = y[44]
        drive = 3.0 * turn * turn * (velocity[1] + 0.1 * spin[2])
        dy[44] = -GROWTH * turn * (y[43] ** 2 - 1.0) * y[44] - turn * turn * y[43] + drive
        side = 0.25 * fish.density * u * u * WIDTH * LENGTH * e.wake_oscillator_lift * y[43]
        wrench[1] += side
        wrench[5] -= 0.25 * LENGTH * side
    if e.bistable_wake_coefficient != 0.0:
        side, u = y[45], velocity[0]
        dy[45] = (side - side**3 + PUSHED * velocity[1]) / LEANING
        lift = e.bistable_wake_coefficient * u * u * side
        wrench[1] += lift
        wrench[5] -= 0.25 * LENGTH * lift
