"""The tail: commanded motion, lift and drag at its centre of pressure (paper III.C.1)."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Tail, Vector, Wrench
from fish_env.model.trigonometry import sincos

TWO_PI = 6.283185307179586
SETTLING_TIME = 0.02
"""s. A jump of the tail's rate reaches the water's inertia over about this time."""
UNTOLD_STEP = 1e-3
"""s. Taken for the length of the step before a run."""
SWITCH = 1e-4
SWITCH_RATE = 0.05
"""rad, rad/s. What a command or its rate jumps by where it switches; else it is known better."""


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


@kernel
def angle_at(tail, bent, ahead):
    """The tail's angle some time ahead of its record, or before it (rad)."""
    return tail.angle + ahead * (tail.rate + ahead * (0.5 * tail.acceleration + ahead * bent))


@kernel
def bend(tail, since, told):
    """A sixth of the jerk (rad/s^3) by which the tail came from what it was at the step's start.

    None where its command has switched since it was ``told`` (rad).
    """
    gap = angle_at(tail, 0.0, -since) - told
    within = (since > 0.0) & (abs(gap) < SWITCH)
    return gap / (since * since * since if within else 1.0) if within else 0.0


@kernel
def window(tail, since, step, told, told_rate):
    """Half a step before and half a step after the present, as times in this step (s).

    The mean of a rate over such a window adds up, with the weights of a Runge-Kutta step, to
    exactly what the angle gains, wherever in a step the rate jumps. It does not reach back over a
    switch of the command from what was ``told`` at the end of the step before (rad, rad/s).

    Returns:
        Begin and end (s), and what the window takes of the step before, as a share of half a step.
    """
    half = 0.5 * step
    early = max(since - half, 0.0)
    jump = abs(angle_at(tail, 0.0, -since) - told)
    kink = abs(tail.rate - since * tail.acceleration - told_rate)
    switched = (jump > SWITCH) | (kink > SWITCH_RATE)
    return early, since + half, 0.0 if switched else 1.0 - (since - early) / half
