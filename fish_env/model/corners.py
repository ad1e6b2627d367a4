"""A tail whose rate jumps within a step: steps are parted where it does.

``Effect.corner`` says when the rate jumps first, and how the tail moves until then. The hook of the
tail moves it in a part of a step without jumps.
"""

from __future__ import annotations

import math

from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import spread_jumps

MEMORY = ("angle", "rate", "acceleration", "side")
"""What a tail remembers of the end of the last part of a step: its angle (rad), its rate (rad/s)
and acceleration (rad/s^2) there, and which way it moves in a part without jumps."""
TOUCH = 2e-5
"""rad. An angle this close to another one has met it."""
NEWTON_STEPS = 5
FOLLOWED = 0.5
"""Time constants. A step that follows a rate with 1 rad/s left on its way to where it settles."""
SLOW = 1e-4
"""rad/s. As good as settled."""


@kernel
def cubic(tail, later, length):
    """Coefficients of the angle (rad) over a part of a step, which goes from 0 to 1.

    Args:
        tail: when the part begins.
        later: at its end.
        length: of the part (s).
    """
    first, last = length * tail.rate, length * later.rate
    gain = later.angle - tail.angle
    return tail.angle, first, 3.0 * gain - 2.0 * first - last, first + last - 2.0 * gain


@kernel
def rises(a, b, c, d):
    """Where a + b s + c s^2 + d s^3 rises through zero: s in [0, 1], infinite where it does not.

    By Newton's method from the end, where it is above zero.
    """
    s = 1.0
    for _ in range(NEWTON_STEPS):
        value = a + s * (b + s * (c + s * d))
        slope = b + s * (2.0 * c + s * 3.0 * d)
        s = min(max(s - value / (slope if slope != 0.0 else 1.0), 0.0), 1.0)
    return s if a + b + c + d > 0.0 else math.inf


@kernel
def followed(time_constant, excess):
    """Longest step that follows a rate (rad/s) on its way to where it settles (s).

    What a Runge-Kutta step gets wrong goes with its length to the fifth, and forces go with the
    square of the rate. For equal errors in equal times the length goes with excess^(-1/2).

    Args:
        time_constant: of the way (s).
        excess: what is left of it (rad/s).
    """
    return FOLLOWED * time_constant / math.sqrt(max(excess, SLOW))


@kernel
def handed_on(on, tail, moved, settled_rate, side):
    """What a tail hook returns: the moved tail where the effect is on, else the command's."""
    spread, slope = spread_jumps(moved, settled_rate)
    seen = Tail(
        spread.angle if on else tail.angle,
        spread.rate if on else tail.rate,
        spread.acceleration if on else tail.acceleration,
    )
    acceleration = moved.acceleration if on else 0.0
    return seen, (slope if on else 0.0,), (seen.angle, seen.rate, acceleration, side)


@kernel
def starting(angle, tail, side):
    """What is remembered at the start of a run, with the tail at an angle (rad)."""
    return angle, tail.rate, tail.acceleration, side
