"""Servo torque limit: the load of the water slows the servo down.

A d.c. motor turns the slower the larger its load: along a straight line from its speed without
load to its stall torque. The load is the moment of lift and drag about the tail's hinge. It grows
with the rate of the tail, so that the speed at which the two agree is solved for. The gear holds
the tail where the water resists with more than the stall torque, and it does not let water that
helps turn the motor faster than without load.
"""

from __future__ import annotations

import math
from math import inf

from fish_env.model.corners import MEMORY, handed_on, starting
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.servo import chase, hinge_flow, hinge_moment, met_or_left
from fish_env.model.tail import SETTLING_TIME

ROUNDING = 1e-9  # rad; a tail this close to its command is on it


@kernel
def speed_under_load(side, across, along, fish, e):
    """Solve rate = speed (1 - resistance(rate) / torque) for the rate in [0, speed] (rad/s).

    Newton's method, from a rate that is never too low: that of a resistance which leaves out the
    flow along the tail. Three steps leave less than a thousandth.

    Args:
        side: 1 for a tail that turns to positive angles, -1 for one that turns back.
        across: n_t . v of a tail at rest (m/s).
        along: square of the flow in the tail's plane (m^2/s^2).
        fish: the fish.
        e: parameters.
    """
    slope = e.speed / e.torque
    least = fish.tail_c0 + min(fish.tail_c1, fish.tail_c2)
    load = slope * 0.5 * fish.density * fish.tail_area * fish.tail_r_c * least
    against = -side * across
    free = max(against + fish.tail_r_c * e.speed, 0.0)
    flow = 2.0 * free / (1.0 + math.sqrt(1.0 + 4.0 * load * fish.tail_r_c * free))
    rate = min(max((flow - against) / fish.tail_r_c, 0.0), e.speed)
    for _ in range(3):
        moment, steep = hinge_moment(against + fish.tail_r_c * rate, along, fish)
        missing = rate - e.speed + slope * moment
        rate = min(max(rate - missing / (1.0 + slope * fish.tail_r_c * steep), 0.0), e.speed)
    return rate


@kernel
def speed_now(tail, motion, angle, reach, fish, e):
    """Speed at which the servo turns from an angle (rad) towards its command, by ``reach`` at most.

    Returns:
        The speed (rad/s).
    """
    gap = tail.angle - angle
    here = angle + min(max(gap, -reach), reach)
    left = tail.angle - here
    side = 1.0 if (left if abs(left) > ROUNDING else tail.rate) > 0.0 else -1.0
    across, along = hinge_flow(motion, here, fish)
    return speed_under_load(side, across, along, fish, e)


@kernel
def turn_against_water(tail, inputs, phase, time, fish, motion, e, states, memory, since):
    """The tail moves towards its command at the mean speed that its load left in this part."""
    (settled_rate,) = states
    angle, _, _, side, before = memory
    on = e.torque < inf
    now = speed_now(tail, motion, angle, before * since, fish, e)
    moved = chase(tail, 0.5 * (before + now), now, angle, side, since)
    seen, slopes, kept = handed_on(on, tail, moved, settled_rate, side)
    speed = now if on else e.speed
    return seen, slopes, (kept[0], kept[1], kept[2], kept[3], speed)


@kernel
def turns(e):
    """Whether it is on."""
    return e.torque < inf


@kernel
def corner(tail, phase, later, later_phase, e, memory, length):
    """When the tail meets its command, or the command becomes too fast for its load."""
    angle, rate, acceleration, _, before = memory
    when, angle, side = met_or_left(tail, later, before, angle, length)
    return when, (angle, rate, acceleration, side, before)


@kernel
def start_at_command(inputs, tail, fish, e):
    """The run starts with the tail at its command, at no more than the speed without load."""
    rate = min(max(tail.rate, -e.speed), e.speed) if e.torque < inf else tail.rate
    side = 1.0 if tail.rate > e.speed else (-1.0 if tail.rate < -e.speed else 0.0)
    return rate, *starting(tail.angle, tail, side), e.speed


def speed_alone(values):
    """A motor that the water does not slow down has a largest rate and nothing else."""
    return {"servo_rate_limit": {"rate": values["speed"]}} if values["torque"] < inf else {}


def fastest(values):
    """Jumps of the rate are spread over a fixed time."""
    return SETTLING_TIME if values["torque"] < inf else inf


EFFECT = Effect(
    name="servo_torque_limit",
    section="actuation",
    summary="Fast strokes fall short, more so the larger the moment of the water on the tail.",
    equation=(
        "d(xi)/dt = clip(towards cmd, -limit, limit), limit = speed (1 - resistance/torque) "
        "within [0, speed], resistance = -+ (arm x (drag + lift))_z at that rate"
    ),
    source="Speed-torque line of a d.c. motor: Spong, Robot Modeling and Control, section 6.1",
    parameters=(
        EffectParameter("torque", "N m", inf, 1e-4, inf, (0.01, 0.1), "stall torque at the tail"),
        EffectParameter(
            "speed", "rad/s", 9.0, 1.0, 100.0, (6.0, 12.0), "without load", shapes=True,
            probed=False,
        ),
    ),
    hooks={"tail": turn_against_water},
    states={"tail": ("settled_rate",)},
    memory={"tail": (*MEMORY, "speed")},
    initial_states=start_at_command,
    turns=turns,
    corner=corner,
    loaded=True,
    time_scale=fastest,
    order=4,
    confusable_with=(
        "beat_load",
        "body_flexibility",
        "servo_lag",
        "servo_rate_limit",
        "tail_gain",
    ),
    parts=speed_alone,
)  # fmt: skip
