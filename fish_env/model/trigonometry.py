"""Sine and cosine without a branch or a library call, so that a batch runs in vector registers."""

from __future__ import annotations

from fish_env.model.jit import kernel

# pi/2 in three parts, the first two short enough that n * part is exact for |n| < 2**20.
_HALF_PI_1 = 1.5707963267341256
_HALF_PI_2 = 6.077100506303966e-11
_HALF_PI_3 = 2.0222662487959506e-21
_TWO_OVER_PI = 0.6366197723675814
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to an integer


@kernel
def rounded(value):
    """The nearest whole number, for abs(value) < 2**50."""
    return (value + _ROUND) - _ROUND


@kernel
def sincos(angle):
    """Sine and cosine of an angle (rad), to one unit in the last place for abs(angle) < 1e6.

    The angle is reduced to [-pi/4, pi/4] in three steps (Cody and Waite), where the Taylor series
    to x^17 and x^16 are exact to double precision.
    """
    turns = (angle * _TWO_OVER_PI + _ROUND) - _ROUND
    x = ((angle - turns * _HALF_PI_1) - turns * _HALF_PI_2) - turns * _HALF_PI_3
    y = x * x
    y2 = y * y
    y4 = y2 * y2
    low = (y * (1.0 / 120.0) - 1.0 / 6.0) + y2 * (y * (1.0 / 362880.0) - 1.0 / 5040.0)
    high = (y * (1.0 / 6227020800.0) - 1.0 / 39916800.0) + y2 * (
        y * (1.0 / 355687428096000.0) - 1.0 / 1307674368000.0
    )
    sine = x + (x * y) * (low + y4 * high)
    low = (y * (1.0 / 24.0) - 0.5) + y2 * (y * (1.0 / 40320.0) - 1.0 / 720.0)
    high = (y * (1.0 / 479001600.0) - 1.0 / 3628800.0) + y2 * (
        y * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0
    )
    cosine = 1.0 + y * (low + y4 * high)
    quarter = turns - 4.0 * (((turns - 1.5) * 0.25 + _ROUND) - _ROUND)
    odd = (quarter == 1.0) | (quarter == 3.0)
    first = cosine if odd else sine
    second = sine if odd else cosine
    return (
        -first if quarter >= 2.0 else first,
        -second if (quarter == 1.0) | (quarter == 2.0) else second,
    )


@kernel
def exponential(x):
    """e^x for x in [-30, 30] (values beyond are clamped), to about 1e-12 relative.

    e^(x/1024) from its Taylor series, squared ten times: no branch, no division, no library call.
    """
    small = min(max(x, -30.0), 30.0) * (1.0 / 1024.0)
    s2 = small * small
    low = (1.0 + small) + s2 * (0.5 + small * (1.0 / 6.0))
    high = (1.0 / 24.0 + small * (1.0 / 120.0)) + s2 * (1.0 / 720.0 + small * (1.0 / 5040.0))
    value = low + (s2 * s2) * high
    for _ in range(10):
        value = value * value
    return value
