"""A tail whose rate jumps within a step: what the water sees of it still adds up.

There are two ways. A rollout parts its steps where the rate jumps: ``Effect.corner`` says when, and
``Effect.part`` moves the tail until then. Where steps are the same for all lanes, as in a filter,
the hook of the tail hands on the mean of the rate over one step.
"""

from __future__ import annotations

import math

from fish_env.model.jit import kernel
from fish_env.model.records import Tail

MEMORY = ("angle", "told", "told_rate", "gained", "step", "side")
"""What is kept from step to step: where tail and command were (rad), how fast the command was
(rad/s), what the tail gained on it in the second half of the step (rad), its length (s), and which
way the tail moves in a part of a step without jumps."""
TOUCH = 2e-5
"""rad. An angle this close to another one has met it."""
NEWTON_STEPS = 5
FOLLOWED = 0.5
"""Time constants. A step that follows a rate with 1 rad/s left on its way to where it settles."""
SLOW = 1e-4
"""rad/s. As good as settled."""
UNTOLD_STEP = 1e-3
"""s. Taken for the length of the step before a run."""
SWITCH = 1e-4
SWITCH_RATE = 0.05
"""rad, rad/s. What a command or its rate jumps by where it switches; else it is known better."""


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


@kernel
def rate_against_stops(tail, lower, upper, held, step):
    """Rate of a tail between stops, its jumps spread as means over one step (rad/s).

    Args:
        tail: the tail without the stops.
        lower: stop (rad).
        upper: stop (rad).
        held: whether a stop holds it now.
        step: length of a step (s).
    """
    early, late = angle_at(tail, 0.0, -0.5 * step), angle_at(tail, 0.0, 0.5 * step)
    gained = min(max(late, lower), upper) - min(max(early, lower), upper)
    jump = gained - (0.0 if held else late - early)  # zero away from the stops
    return (0.0 if held else tail.rate) + jump / step


@kernel
def follow(ahead_of, limit, tail, since, memory):
    """How a tail follows its command, however its rate jumps.

    Args:
        ahead_of: (angle, command, bent, since, at, limit) -> how far the tail is ahead of its
            command a time ``at`` after the step's start (rad); see :func:`bend`.
        limit: its last argument.
        tail: the command at present.
        since: time from the step's start (s).
        memory: see :data:`MEMORY`.

    Returns:
        How far the tail is ahead at present (rad), its mean rate over one step around the present
        (rad/s), and what it gained in the second half of the step so far (rad).
    """
    angle, told, told_rate, gained, step, _ = memory
    bent = bend(tail, since, told)
    early, late, before = window(tail, since, step, told, told_rate)
    ahead = ahead_of(angle, tail, bent, since, since, limit)
    gain = ahead_of(angle, tail, bent, since, late, limit)
    gain -= ahead_of(angle, tail, bent, since, early, limit)
    rate = tail.rate + (gain + before * gained) / (late - early + 0.5 * before * step)
    return ahead, rate, ahead - ahead_of(angle, tail, bent, since, 0.5 * since, limit)


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
def gained_in_half(tail, moved, since):
    """What a tail gains on its command in the last half of a part without jumps (rad)."""
    return 0.5 * since * (moved.rate - tail.rate)


@kernel
def handed_on(on, tail, moved, gained, since, side):
    """What a tail hook returns: the moved tail where the effect is on, else the command's."""
    seen = Tail(
        moved.angle if on else tail.angle,
        moved.rate if on else tail.rate,
        moved.acceleration if on else tail.acceleration,
    )
    return (
        seen,
        (moved.acceleration if on else 0.0,),
        (seen.angle, tail.angle, tail.rate, gained if on else 0.0, since, side),
    )


@kernel
def starting(angle, tail, side):
    """What is remembered at the start of a run, with the tail at an angle (rad)."""
    return angle, tail.angle, tail.rate, 0.0, UNTOLD_STEP, side
