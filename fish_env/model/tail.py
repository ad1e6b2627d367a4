"""The tail: commanded motion, lift and drag at its centre of pressure (paper III.C.1)."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Tail, Vector, Wrench
from fish_env.model.trigonometry import sincos

TWO_PI = 6.283185307179586
SETTLING_TIME = 0.02
"""s. A jump of the tail's rate reaches the water's inertia over about this time."""


@kernel
def commanded_tail(inputs, phase):
    """xi1 = xi1_bar + A1 sin(phi_t) and its two derivatives, d(phi_t)/dt = 2 pi f1.

    The rates of offset, amplitude and frequency enter while an actuator slews.
    """
    sine, cosine = sincos(phase)
    omega = TWO_PI * inputs.tail_frequency
    return Tail(
        inputs.tail_offset + inputs.tail_amplitude * sine,
        omega * inputs.tail_amplitude * cosine
        + inputs.tail_offset_rate
        + inputs.tail_amplitude_rate * sine,
        2.0 * omega * inputs.tail_amplitude_rate * cosine
        + TWO_PI * inputs.tail_frequency_rate * inputs.tail_amplitude * cosine
        - omega * omega * inputs.tail_amplitude * sine,
    )


@kernel
def tail_arm(tail, fish):
    """O_t to the centre of pressure (m, body): [-r_c cos xi1, -r_c sin xi1, 0]; and n_t (unit)."""
    sine, cosine = sincos(tail.angle)
    arm = Vector(-fish.tail_r_c * cosine, -fish.tail_r_c * sine, 0.0)
    return arm, Vector(-sine, cosine, 0.0)


@kernel
def tail_velocity(motion, tail, arm, fish):
    """Velocity of the centre of pressure relative to the water (m/s, body).

    v_t = V_b + omega_b x r_t + [0, 0, d(xi1)/dt] x arm, r_t = root + arm.
    """
    x = fish.tail_root_x + arm.x
    y = fish.tail_root_y + arm.y
    z = fish.tail_root_z + arm.z
    return Vector(
        motion.u + (motion.q * z - motion.r * y) - tail.rate * arm.y,
        motion.v + (motion.r * x - motion.p * z) + tail.rate * arm.x,
        motion.w + (motion.p * y - motion.q * x),
    )


@kernel
def wrench_at(x, y, z, force):
    """Wrench about O_b of a force (N, body) acting at a point (m, body)."""
    return Wrench(
        force.x,
        force.y,
        force.z,
        y * force.z - z * force.y,
        z * force.x - x * force.z,
        x * force.y - y * force.x,
    )


@kernel
def tail_wrench(arm, force, fish):
    """Wrench about O_b of a force at the tail's centre of pressure: M_t = r_t x F."""
    return wrench_at(
        fish.tail_root_x + arm.x, fish.tail_root_y + arm.y, fish.tail_root_z + arm.z, force
    )


@kernel
def hinge_power(tail, arm, force):
    """Mechanical power that the servo delivers to the water, positive part (W).

    The servo does not regenerate, so the water driving the tail counts as zero.
    """
    moment = arm.x * force.y - arm.y * force.x
    power = -moment * tail.rate
    return power if power > 0.0 else 0.0


@kernel
def spread_jumps(tail, settled_rate):
    """The tail with an acceleration that integrates to its rate even where that rate jumps.

    d(settled)/dt = acceleration + (rate - settled) / SETTLING_TIME. Where the rate is smooth and
    the acceleration is its derivative, settled = rate and nothing changes; a jump is made up for
    within some SETTLING_TIME, so that the water's inertia receives its whole impulse.

    Returns:
        The tail, and d(settled)/dt (rad/s^2), which is its acceleration.
    """
    slope = tail.acceleration + (tail.rate - settled_rate) * (1.0 / SETTLING_TIME)
    return Tail(tail.angle, tail.rate, slope), slope
