"""Reactive tail force: Lighthill's large-amplitude elongated-body theory for a rigid tail.

The tail is a strip of length L = 2 r_c and depth S_t / L with virtual mass
m = rho pi depth^2 / 4 per length. With a the unit vector from root to tip, n the tail's normal
and w = g0 + sigma g1 the normal velocity at a distance sigma from the root, the water it carries
has the impulse P n, P = m (L g0 + L^2/2 g1), and the angular impulse root x n P - z Q,
Q = m (L^2/2 g0 + L^3/3 g1). The force on the tail is minus their rate of change, and at the tip
-m u_tip w_tip n (momentum left in the wake) and m w_tip^2 / 2 forward along the tail (pressure).
The parts with dV/dt and domega/dt are added mass and enter the mass matrix.
"""

from __future__ import annotations

from typing import NamedTuple

from fish_env.model.body import flow_drift
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.frames import cross
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import add_rank_one
from fish_env.model.records import Vector, Wrench
from fish_env.model.trigonometry import sincos

QUARTER_PI = 0.7853981633974483


class Strip(NamedTuple):
    """Tail as a strip: aft and normal unit vectors, root (m), root x n, length (m), kg/m."""

    aft: Vector
    normal: Vector
    root: Vector
    lever: Vector
    length: float
    mass: float


@kernel
def strip(tail, fish, e):
    """The strip at the tail's present angle, body frame."""
    sine, cosine = sincos(tail.angle)
    normal = Vector(-sine, cosine, 0.0)
    root = Vector(fish.tail_root_x, fish.tail_root_y, fish.tail_root_z)
    length = 2.0 * fish.tail_r_c
    depth = fish.tail_area / length
    mass = e.scale * (QUARTER_PI * fish.density * depth * depth)
    return Strip(Vector(-cosine, -sine, 0.0), normal, root, cross(root, normal), length, mass)


@kernel
def dot(a, b):
    """Scalar product."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def reactive_inertia(inertia, tail, fish, e):
    """m [L e0 e0^T + L^2/2 (e0 e1^T + e1 e0^T) + L^3/3 e1 e1^T].

    e0 = [n, root x n], e1 = [0, -z].
    """
    s = strip(tail, fish, e)
    length = s.length
    e0 = Wrench(s.normal.x, s.normal.y, 0.0, s.lever.x, s.lever.y, s.lever.z)
    e1 = Wrench(0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    result = add_rank_one(inertia, s.mass * length, e0, e0)
    result = add_rank_one(result, s.mass * length * length, e0, e1)
    return add_rank_one(result, s.mass * length * length * length / 3.0, e1, e1)


@kernel
def reactive_wrench(motion, tail, inputs, centre, fish, e):
    """The part of the reactive force that does not depend on the body's accelerations."""
    s = strip(tail, fish, e)
    length, half, third = s.length, 0.5 * s.length * s.length, s.length**3 / 3.0
    omega = Vector(motion.p, motion.q, motion.r)
    velocity = Vector(motion.u, motion.v, motion.w)
    turning = cross(omega, s.root)
    at_root = Vector(velocity.x + turning.x, velocity.y + turning.y, velocity.z + turning.z)
    g0 = dot(s.normal, at_root)
    g1 = -(motion.r + tail.rate)
    g0_rate = tail.rate * dot(s.aft, at_root) + dot(s.normal, flow_drift(motion))
    g1_rate = -tail.acceleration
    impulse = s.mass * (length * g0 + half * g1)
    impulse_rate = s.mass * (length * g0_rate + half * g1_rate)
    moment = s.mass * (half * g0 + third * g1)
    moment_rate = s.mass * (half * g0_rate + third * g1_rate)

    linear = Vector(impulse * s.normal.x, impulse * s.normal.y, 0.0)
    angular = Vector(impulse * s.lever.x, impulse * s.lever.y, impulse * s.lever.z - moment)
    swing = impulse * tail.rate
    sweep = cross(s.root, s.aft)
    convected = cross(omega, linear)
    turned = cross(omega, angular)
    carried = cross(velocity, linear)

    tip = Vector(s.root.x + length * s.aft.x, s.root.y + length * s.aft.y, s.root.z)
    tip_turning = cross(omega, tip)
    forward = -(s.aft.x * (velocity.x + tip_turning.x) + s.aft.y * (velocity.y + tip_turning.y))
    w_tip = g0 + length * g1
    shed = -s.mass * forward * w_tip
    suction = -0.5 * s.mass * w_tip * w_tip
    at_tip = Vector(
        shed * s.normal.x + suction * s.aft.x, shed * s.normal.y + suction * s.aft.y, 0.0
    )
    tip_moment = cross(tip, at_tip)
    return Wrench(
        at_tip.x - (impulse_rate * s.normal.x + swing * s.aft.x + convected.x),
        at_tip.y - (impulse_rate * s.normal.y + swing * s.aft.y + convected.y),
        -convected.z,
        tip_moment.x - (impulse_rate * s.lever.x + swing * sweep.x + turned.x + carried.x),
        tip_moment.y - (impulse_rate * s.lever.y + swing * sweep.y + turned.y + carried.y),
        tip_moment.z
        - (impulse_rate * s.lever.z - moment_rate + swing * sweep.z + turned.z + carried.z),
    )


EFFECT = Effect(
    name="tail_reactive",
    section="hydrodynamics",
    summary="The tail accelerates water: thrust from virtual mass, in addition to lift and drag.",
    equation=(
        "F = -d/dt int m w n dsigma - m u_tip w_tip n + (m w_tip^2 / 2) forward, "
        "m = scale rho pi depth^2 / 4"
    ),
    source="Lighthill (1971), Large-amplitude elongated-body theory of fish locomotion",
    parameters=(
        EffectParameter("scale", "-", 0.0, 0.0, 5.0, (0.1, 1.5), "1 is the theory's virtual mass"),
    ),
    hooks={"inertia": reactive_inertia, "wrench": reactive_wrench},
    confusable_with=(
        "added_mass",
        "tail_flexibility",
        "tail_gain",
        "tail_stall",
        "wake_memory",
    ),
)
