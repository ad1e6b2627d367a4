"""Lift, drag and impact-moment coefficients: analytic forms, or the user's own tables.

Both variants answer the same three questions, so the force functions do not know which one they
use. With s = sin(alpha) = n . v/|v|: ``drag`` gives C_D, ``lift`` gives C_L sign(s)/cos(alpha)
(what multiplies the vector |v| n - s v), ``moment`` gives C_M for signed alpha.
"""

from __future__ import annotations

import math

from fish_env.model.jit import kernel

HALF_PI = 1.5707963267948966


@kernel
def analytic_drag(s, c0, c2, tables, curve):
    """C_D = c0 + c2 sin^2(alpha)."""
    return c0 + c2 * (s * s)


@kernel
def analytic_lift(s, c1, tables, curve):
    """C_L = c1 sin|alpha| cos|alpha|, divided by cos(alpha) and signed: c1 s."""
    return c1 * s


@kernel
def analytic_moment(s, cosine, k, tables, curve):
    """C_M = k sin(alpha) cos(alpha) (m)."""
    return k * (s * cosine)


@kernel
def table_value(angle, tables, curve):
    """Cubic piece of a packed curve at an angle in [0, pi/2] (rad)."""
    low = 0
    high = tables.shape[1] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if tables[curve, middle, 0] <= angle:
            low = middle
        else:
            high = middle
    x = angle - tables[curve, low, 0]
    value = tables[curve, low, 1] * x + tables[curve, low, 2]
    return (value * x + tables[curve, low, 3]) * x + tables[curve, low, 4]


@kernel
def table_drag(s, c0, c2, tables, curve):
    """C_D from the table of this curve, or its analytic form where it has none."""
    if tables[curve, 0, 0] < 0.0:
        return c0 + c2 * (s * s)
    return table_value(math.asin(min(abs(s), 1.0)), tables, curve)


@kernel
def table_lift(s, c1, tables, curve):
    """C_L sign(s)/cos(alpha) from the table; zero where the flow is along the normal."""
    if tables[curve, 0, 0] < 0.0:
        return c1 * s
    cosine = math.sqrt(max(1.0 - s * s, 0.0))
    if cosine < 1e-9:
        return 0.0
    value = table_value(math.asin(min(abs(s), 1.0)), tables, curve) / cosine
    return value if s > 0.0 else -value


@kernel
def table_moment(s, cosine, k, tables, curve):
    """C_M from the table, continued as an odd function of alpha."""
    if tables[curve, 0, 0] < 0.0:
        return k * (s * cosine)
    value = table_value(math.asin(min(abs(s), 1.0)), tables, curve)
    return value if s > 0.0 else -value
