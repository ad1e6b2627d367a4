"""A servo that turns no faster than a limit, and the load of the water on its hinge."""

from __future__ import annotations

import math

from fish_env.model.corners import TOUCH, angle_at, cubic, follow, rises
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import spread_jumps, tail_arm, tail_velocity

ROUNDING = 1e-9  # rad; a tail this close to its command is on it


@kernel
def ahead_of_command(angle, tail, bent, since, at, limit):
    """How far the tail is ahead of its command, a time ``at`` after the step's start (rad).

    The exact solution of d(xi)/dt = clip(towards cmd, -limit, limit) from ``angle`` at the step's
    start, for a command that bends little in a step. The tail moves at its limit until it meets
    its command, and then follows it as far as the limit allows.
    """
    gap = angle_at(tail, bent, -since) - angle
    behind = abs(gap) > ROUNDING
    towards = limit if gap > 0.0 else -limit
    closing = towards - (tail.rate - since * (tail.acceleration - 3.0 * since * bent))
    approaching = behind & (closing * gap > 0.0)
    meeting = gap / (closing if approaching else 1.0)
    slowed = closing - 0.5 * tail.acceleration * meeting
    meeting = gap / (slowed if approaching & (slowed * gap > 0.0) else 1.0)
    apart = min(meeting, at) if approaching & (slowed * gap > 0.0) else at
    chasing = apart if behind else 0.0
    reached = angle + towards * chasing
    reach = limit * (at - chasing)
    goal = angle_at(tail, bent, at - since)
    return reached + min(max(goal - reached, -reach), reach) - goal


@kernel
def chase(tail, limit, settled_rate, since, memory):
    """The tail that follows its command at a rate of at most ``limit`` (rad/s).

    Args:
        tail: the command at present.
        limit: largest rate (rad/s).
        settled_rate: state of :func:`spread_jumps`.
        since: time from the step's start (s).
        memory: see :data:`fish_env.model.corners.MEMORY`.

    Returns:
        The tail, and what it gained in the second half of the step so far (rad).
    """
    ahead, rate, gained = follow(ahead_of_command, limit, tail, since, memory)
    behind = (abs(ahead) > ROUNDING) | (abs(tail.rate) > limit)
    limited, _ = spread_jumps(
        Tail(
            tail.angle + ahead,
            min(max(rate, -limit), limit),
            0.0 if behind else tail.acceleration,
        ),
        settled_rate,
    )
    return limited, gained


@kernel
def chase_in_part(tail, limit, now, settled_rate, since, memory):
    """As :func:`chase`, in a part of a step in which the rate does not jump.

    Args:
        tail: the command at present.
        limit: largest rate, its mean in this part (rad/s).
        now: the same at present.
        settled_rate: state of :func:`spread_jumps`.
        since: time from the start of the part (s).
        memory: see :data:`fish_env.model.corners.MEMORY`; ``side`` is 0 where the tail moves with
            its command, 1 and -1 where it moves at its limit.

    Returns:
        The tail.
    """
    side = memory[5]
    behind = side != 0.0
    moved = Tail(
        memory[0] + side * limit * since if behind else tail.angle,
        side * now if behind else min(max(tail.rate, -now), now),
        0.0 if behind else tail.acceleration,
    )
    spread, _ = spread_jumps(moved, settled_rate)
    return spread


@kernel
def met_or_left(tail, later, limit, memory, length):
    """When a tail of limited rate meets its command, or the command leaves it behind.

    Args:
        tail: the command when a part of a step begins.
        later: the command at its end.
        limit: largest rate (rad/s).
        memory: see :data:`fish_env.model.corners.MEMORY`.
        length: of the part (s).

    Returns:
        The time from the start of the part (s), infinite where neither happens, and the memory for
        the time until then.
    """
    gap = tail.angle - memory[0]
    touching, reach = abs(gap) <= TOUCH, limit * length
    ahead = tail.rate if touching else gap
    way = 1.0 if ahead > 0.0 else -1.0
    side = 0.0 if touching & (abs(tail.rate) <= limit) else way
    angle, b, c, d = cubic(tail, later, length)
    behind, fast = side != 0.0, 1.0 if later.rate > 0.0 else -1.0
    when = length * rises(
        -way * gap if behind else fast * b - reach,
        reach - way * b if behind else 2.0 * fast * c,
        -way * c if behind else 3.0 * fast * d,
        -way * d if behind else 0.0,
    )
    return when, (memory[0] if behind else angle, tail.angle, tail.rate, 0.0, length, side)


@kernel
def hinge_flow(motion, angle, fish):
    """Flow at the centre of pressure of a tail that is held at an angle (rad).

    Returns:
        n_t . v (m/s), and |v|^2 - (n_t . v)^2 (m^2/s^2), which the tail's own rate leaves alone.
    """
    held = Tail(angle, 0.0, 0.0)
    arm, normal = tail_arm(held, fish)
    v = tail_velocity(motion, held, arm, fish)
    across = normal.x * v.x + normal.y * v.y
    return across, max(v.x * v.x + v.y * v.y + v.z * v.z - across * across, 0.0)


@kernel
def hinge_moment(across, along, fish):
    """Moment of lift and drag about the tail's hinge (N m), against a rate that makes the flow.

    arm x F = r_c 1/2 rho S |v| v_n (c0 + c1 + (c2 - c1) s^2), s = v_n / |v|: of the analytic
    coefficients of the tail, without what effects do to its force.

    Args:
        across: v_n, flow along n_t with the tail's rate: that of a held tail less r_c rate (m/s).
        along: square of the flow in the tail's plane (m^2/s^2).
        fish: the fish.

    Returns:
        The moment, and its slope by ``across`` (N s).
    """
    square = across * across + along
    speed = math.sqrt(square)
    inverse = 1.0 / speed if speed > 0.0 else 0.0
    steep = fish.tail_c2 - fish.tail_c1
    share = across * across * inverse * inverse
    coefficient = fish.tail_c0 + fish.tail_c1 + steep * share
    scale = 0.5 * fish.density * fish.tail_area * fish.tail_r_c
    bent = (square + across * across) * coefficient + 2.0 * steep * share * along
    return scale * speed * across * coefficient, scale * bent * inverse
