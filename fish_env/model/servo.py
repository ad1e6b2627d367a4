"""A servo that turns no faster than a limit, and the load of the water on its hinge."""

from __future__ import annotations

import math

from fish_env.model.corners import TOUCH, cubic, rises
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import tail_arm, tail_velocity


@kernel
def chase(tail, limit, now, angle, side, since):
    """The tail that follows its command at a limited rate, in a part of a step without jumps.

    Args:
        tail: the command at present.
        limit: largest rate, its mean in this part (rad/s).
        now: the same at present.
        angle: of the tail at the start of the part (rad).
        side: 0 where the tail moves with its command, 1 and -1 where it moves at its limit.
        since: time from the start of the part (s).

    Returns:
        The tail.
    """
    behind = side != 0.0
    return Tail(
        angle + side * limit * since if behind else tail.angle,
        side * now if behind else min(max(tail.rate, -now), now),
        0.0 if behind else tail.acceleration,
    )


@kernel
def met_or_left(tail, later, limit, angle, length):
    """When a tail of limited rate meets its command, or the command leaves it behind.

    Args:
        tail: the command when a part of a step begins.
        later: the command at its end.
        limit: largest rate (rad/s).
        angle: of the tail when the part begins (rad).
        length: of the part (s).

    Returns:
        The time from the start of the part (s), infinite where neither happens, and the angle and
        the side with which the tail moves until then, see :func:`chase`.
    """
    gap = tail.angle - angle
    touching, reach = abs(gap) <= TOUCH, limit * length
    ahead = tail.rate if touching else gap
    way = 1.0 if ahead > 0.0 else -1.0
    side = 0.0 if touching & (abs(tail.rate) <= limit) else way
    first, b, c, d = cubic(tail, later, length)
    behind, fast = side != 0.0, 1.0 if later.rate > 0.0 else -1.0
    when = length * rises(
        -way * gap if behind else fast * b - reach,
        reach - way * b if behind else 2.0 * fast * c,
        -way * c if behind else 3.0 * fast * d,
        -way * d if behind else 0.0,
    )
    return when, angle if behind else first, side


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
