"""Body flexibility: the hull bends where the tail is fixed, as far as the water loads the tail.

The tail turns about a joint that is a spring: the servo sets the angle of the spring's other end.
The load is the moment of lift and drag about the tail's hinge. Unlike a flexible tail, which is
late whatever the water does, a flexible body gives way more the faster the fish beats and swims.
"""

from __future__ import annotations

from math import inf

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.servo import hinge_flow, hinge_moment
from fish_env.model.tail import TWO_PI

LOAD_SLOPE = 0.03
"""Moment of the water by the tail's rate, at 0.5 m/s (N m s): rho S r_c^2 |v| c1 of the paper's
fish. It makes a soft joint follow the water faster than it swings by itself."""


@kernel
def give_way(tail, inputs, phase, time, fish, motion, e, states):
    """delta'' = w^2 (moment/stiffness - delta) - 2 zeta w delta', xi = cmd + delta."""
    bend, rate = states
    on = e.stiffness < inf
    omega = TWO_PI * e.natural_frequency
    across, along = hinge_flow(motion, tail.angle + bend, fish)
    moment, _ = hinge_moment(across - fish.tail_r_c * (tail.rate + rate), along, fish)
    pulled = moment / (e.stiffness if on else 1.0)
    acceleration = omega * (omega * (pulled - bend) - 2.0 * e.damping_ratio * rate)
    seen = Tail(
        tail.angle + bend if on else tail.angle,
        tail.rate + rate if on else tail.rate,
        tail.acceleration + acceleration if on else tail.acceleration,
    )
    return seen, (rate if on else 0.0, acceleration if on else 0.0)


@kernel
def start_straight(inputs, tail, fish, e):
    """The run starts with the body straight and at rest."""
    return 0.0, 0.0


def fastest(values):
    """Time constant (s) of the joint, or of its damping by the water; infinite when it is off."""
    if values["stiffness"] == inf:
        return inf
    omega = TWO_PI * values["natural_frequency"]
    damping = 2.0 * values["damping_ratio"] * omega + omega**2 * LOAD_SLOPE / values["stiffness"]
    return 1.0 / max(omega, damping)


EFFECT = Effect(
    name="body_flexibility",
    section="actuation",
    summary="The body bends under the load of the tail: fast strokes are smaller and later.",
    equation=(
        "xi = cmd + delta, delta'' = w^2 (arm x (drag + lift))_z / stiffness - w^2 delta "
        "- 2 damping_ratio w delta', w = 2 pi natural_frequency"
    ),
    source="Pseudo-rigid-body model, Howell, Compliant Mechanisms, chapter 5",
    parameters=(
        EffectParameter(
            "stiffness", "N m/rad", inf, 1e-3, inf, (0.1, 1.0), "of the body at the tail's root"
        ),
        EffectParameter(
            "natural_frequency", "Hz", 5.0, 0.5, 20.0, (2.0, 6.0), "of tail and body, undamped",
            shapes=True, probed=False,
        ),
        EffectParameter(
            "damping_ratio", "-", 0.3, 0.05, 5.0, (0.1, 0.5), "1 is critical",
            shapes=True, probed=False,
        ),
    ),
    hooks={"tail": give_way},
    states={"tail": ("bend", "rate")},
    initial_states=start_straight,
    loaded=True,
    time_scale=fastest,
    order=8,
    confusable_with=(
        "servo_lag",
        "servo_torque_limit",
        "tail_flexibility",
        "tail_gain",
    ),
)  # fmt: skip
