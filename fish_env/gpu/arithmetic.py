"""Arithmetic of the device: float32 stand-ins for functions that rely on the bits of float64.

:mod:`fish_env.model.trigonometry` rounds by adding 1.5 * 2**52 and uses constants of 52 bits, which
float32 does not have.
"""

from __future__ import annotations

import math

import numpy as np

from fish_env.model import trigonometry

# pi/2 in three parts, of which multiples up to 2**13 lose nothing in float32 (Cody and Waite).
_HALF_PI_1 = 1.5703125
_HALF_PI_2 = 4.837512969970703125e-4
_HALF_PI_3 = 7.549789948768648e-8
_TWO_OVER_PI = 0.6366197723675814


def rounded(value):
    """The nearest whole number."""
    return math.floor(value + 0.5)


def sincos(angle):
    """Sine and cosine of an angle (rad), to 1e-7 for abs(angle) < 1e4.

    Polynomials of the Cephes library (sinf, cosf) on [-pi/4, pi/4].
    """
    turns = math.floor(angle * _TWO_OVER_PI + 0.5)
    x = ((angle - turns * _HALF_PI_1) - turns * _HALF_PI_2) - turns * _HALF_PI_3
    y = x * x
    sine = x + x * y * (-1.6666654611e-1 + y * (8.3321608736e-3 - y * 1.9515295891e-4))
    cosine = (1.0 - 0.5 * y) + y * y * (
        4.166664568298827e-2 + y * (-1.388731625493765e-3 + y * 2.443315711809948e-5)
    )
    quarter = np.int32(turns) & 3
    odd = (quarter & 1) != 0
    first = cosine if odd else sine
    second = sine if odd else cosine
    return (
        -first if quarter >= 2 else first,
        -second if (quarter == 1) | (quarter == 2) else second,
    )


def exponential(x):
    """e^x for x in [-30, 30] (values beyond are clamped)."""
    return math.exp(min(max(x, -30.0), 30.0))


FLOAT32 = {
    trigonometry.rounded: rounded,
    trigonometry.sincos: sincos,
    trigonometry.exponential: exponential,
}
"""Kernel -> its stand-in where numbers are float32."""
