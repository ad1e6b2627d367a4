"""Block reaction: moving the weight block pushes the hull the other way.

The baseline prescribes the block's position and leaves out the force that moves the block. This
effect adds the reaction of that force on the hull: the block's acceleration in the hull and its
Coriolis part.

An ideal actuator moves the block at once. Its force is infinite, but the displacement of the hull
is finite: -m_w dd / m. To keep this result for every actuator, the reaction is that of a block that
follows its command x in about 0.02 s, critically damped: s'' = 2 (x' - s')/T + (x - s)/T^2.
A block that moves slowly (slew limit, lag) is followed without delay. The barycentre still
follows the command. After a jump, the position of the fish is right to first order in dd.
"""

from __future__ import annotations

from math import inf

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.frames import cross
from fish_env.model.jit import kernel
from fish_env.model.records import Vector
from fish_env.model.tail import wrench_at
from fish_env.model.trigonometry import sincos

APPROACH_TIME = 0.02
"""s. Time constant with which the reaction follows the block."""


@kernel
def approach(place, rate, followed, followed_rate):
    """Acceleration of a block that follows a command (per second squared)."""
    per_second = 1.0 / APPROACH_TIME
    return per_second * (2.0 * (rate - followed_rate) + per_second * (place - followed))


@kernel
def push_back(motion, tail, inputs, centre, fish, e, states):
    """F = -scale m_w (a + 2 omega x v) at the block, a and v being its motion in the hull."""
    stroke, stroke_rate, turn, turn_rate = states
    on = 1.0 if e.scale != 0.0 else 0.0
    stroke_pull = approach(
        inputs.block_displacement, inputs.block_displacement_rate, stroke, stroke_rate
    )
    turn_pull = approach(inputs.block_angle, inputs.block_angle_rate, turn, turn_rate)
    sine, cosine = sincos(turn)
    x = fish.bracket_x + fish.d1 - (fish.s_w0 + stroke - fish.d3)
    y = fish.bracket_y + fish.d2 * sine
    z = fish.bracket_z + fish.d2 * cosine
    velocity = Vector(-stroke_rate, fish.d2 * cosine * turn_rate, -fish.d2 * sine * turn_rate)
    coriolis = cross(Vector(motion.p, motion.q, motion.r), velocity)
    square = turn_rate * turn_rate
    push = -e.scale * fish.mass_block
    force = Vector(
        push * (2.0 * coriolis.x - stroke_pull),
        push * (2.0 * coriolis.y + fish.d2 * (cosine * turn_pull - sine * square)),
        push * (2.0 * coriolis.z - fish.d2 * (sine * turn_pull + cosine * square)),
    )
    slopes = (on * stroke_rate, on * stroke_pull, on * turn_rate, on * turn_pull)
    return wrench_at(x, y, z, force), slopes


@kernel
def start_at_rest(inputs, tail, fish, e):
    """The run starts with the block at rest at its command."""
    return inputs.block_displacement, 0.0, inputs.block_angle, 0.0


def fastest(values):
    """Time constant of the approach; infinite when the effect is off."""
    return APPROACH_TIME if values["scale"] else inf


EFFECT = Effect(
    name="block_reaction",
    section="inertia",
    summary="The hull recoils when the weight block moves.",
    equation="F = -scale m_w (a_w + 2 omega x v_w), M = C_w x F; a_w, v_w of the block in the hull",
    source="d(m C_m)/dt of the system of hull and block; Greenwood, Principles of Dynamics, 4-4",
    parameters=(
        EffectParameter(
            "scale", "-", 0.0, 0.0, 2.0, (0.3, 1.2), "1 is the whole reaction of the block"
        ),
    ),
    hooks={"wrench": push_back},
    states={"wrench": ("stroke", "stroke_rate", "turn", "turn_rate")},
    initial_states=start_at_rest,
    time_scale=fastest,
    confusable_with=(
        "added_mass",
        "block_lag",
    ),
)
