"""Newton's and Euler's equations about O_b (paper equations 33 to 46, expanded form)."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def inertial_wrench(motion, centre):
    """The velocity-dependent inertia terms, moved to the right-hand side (N, N m; body, about O_b).

    -m [omega x V_b + omega x (omega x C_m)] and -omega x (J omega) - m C_m x (omega x V_b), with
    V_b relative to the ground.
    """
    p, q, r = motion.p, motion.q, motion.r
    ax = q * motion.ground_w - r * motion.ground_v
    ay = r * motion.ground_u - p * motion.ground_w
    az = p * motion.ground_v - q * motion.ground_u
    bx = q * centre.z - r * centre.y
    by = r * centre.x - p * centre.z
    bz = p * centre.y - q * centre.x
    mass = centre.mass
    return Wrench(
        -mass * (ax + (q * bz - r * by)),
        -mass * (ay + (r * bx - p * bz)),
        -mass * (az + (p * by - q * bx)),
        (centre.jy - centre.jz) * (q * r) - mass * (centre.y * az - centre.z * ay),
        (centre.jz - centre.jx) * (p * r) - mass * (centre.z * ax - centre.x * az),
        (centre.jx - centre.jy) * (p * q) - mass * (centre.x * ay - centre.y * ax),
    )


@kernel
def solve_symmetric(s00, s10, s20, s11, s21, s22, y0, y1, y2):
    """Solve a symmetric 3x3 system by its adjugate: one division, and no long chain of them."""
    k00 = s11 * s22 - s21 * s21
    k10 = s20 * s21 - s10 * s22
    k20 = s10 * s21 - s20 * s11
    k11 = s00 * s22 - s20 * s20
    k21 = s10 * s20 - s00 * s21
    k22 = s00 * s11 - s10 * s10
    inverse = 1.0 / (s00 * k00 + s10 * k10 + s20 * k20)
    return (
        inverse * (k00 * y0 + k10 * y1 + k20 * y2),
        inverse * (k10 * y0 + k11 * y1 + k21 * y2),
        inverse * (k20 * y0 + k21 * y1 + k22 * y2),
    )


@kernel
def solve_rigid(inertia, wrench):
    """Accelerations (dV/dt, d omega/dt) of a rigid body: the sparse case of :func:`solve_full`.

    Without effects the translational block is m I and the diagonals of the coupling vanish. The
    elimination below is that of :func:`solve_full` with those zeros left out, in the same order,
    so that both give the same bits.
    """
    a = inertia
    inverse = 1.0 / a.m00
    l31, l32 = a.m31 * inverse, a.m32 * inverse
    l40, l42 = a.m40 * inverse, a.m42 * inverse
    l50, l51 = a.m50 * inverse, a.m51 * inverse
    y0, y1, y2 = wrench.fx, wrench.fy, wrench.fz
    x3, x4, x5 = solve_symmetric(
        a.m33 - l31 * a.m31 - l32 * a.m32,
        a.m43 - l42 * a.m32,
        a.m53 - l51 * a.m31,
        a.m44 - l40 * a.m40 - l42 * a.m42,
        a.m54 - l50 * a.m40,
        a.m55 - l50 * a.m50 - l51 * a.m51,
        wrench.mx - l31 * y1 - l32 * y2,
        wrench.my - l40 * y0 - l42 * y2,
        wrench.mz - l50 * y0 - l51 * y1,
    )
    x2 = y2 * inverse - l32 * x3 - l42 * x4
    x1 = y1 * inverse - l31 * x3 - l51 * x5
    x0 = y0 * inverse - l40 * x4 - l50 * x5
    return Wrench(x0, x1, x2, x3, x4, x5)


@kernel
def solve_full(inertia, wrench):
    """Accelerations for a full symmetric positive-definite 6x6 mass matrix.

    The translational half is eliminated (LDL^T, unrolled); what is left of the rotational half,
    its Schur complement, is solved by :func:`solve_symmetric`.
    """
    a = inertia
    i0 = 1.0 / a.m00
    l10, l20, l30, l40, l50 = a.m10 * i0, a.m20 * i0, a.m30 * i0, a.m40 * i0, a.m50 * i0
    i1 = 1.0 / (a.m11 - l10 * a.m10)
    c21 = a.m21 - l20 * a.m10
    c31 = a.m31 - l30 * a.m10
    c41 = a.m41 - l40 * a.m10
    c51 = a.m51 - l50 * a.m10
    l21, l31, l41, l51 = c21 * i1, c31 * i1, c41 * i1, c51 * i1
    i2 = 1.0 / (a.m22 - l20 * a.m20 - l21 * c21)
    c32 = a.m32 - l30 * a.m20 - l31 * c21
    c42 = a.m42 - l40 * a.m20 - l41 * c21
    c52 = a.m52 - l50 * a.m20 - l51 * c21
    l32, l42, l52 = c32 * i2, c42 * i2, c52 * i2
    y0 = wrench.fx
    y1 = wrench.fy - l10 * y0
    y2 = wrench.fz - l20 * y0 - l21 * y1
    x3, x4, x5 = solve_symmetric(
        a.m33 - l30 * a.m30 - l31 * c31 - l32 * c32,
        a.m43 - l40 * a.m30 - l41 * c31 - l42 * c32,
        a.m53 - l50 * a.m30 - l51 * c31 - l52 * c32,
        a.m44 - l40 * a.m40 - l41 * c41 - l42 * c42,
        a.m54 - l50 * a.m40 - l51 * c41 - l52 * c42,
        a.m55 - l50 * a.m50 - l51 * c51 - l52 * c52,
        wrench.mx - l30 * y0 - l31 * y1 - l32 * y2,
        wrench.my - l40 * y0 - l41 * y1 - l42 * y2,
        wrench.mz - l50 * y0 - l51 * y1 - l52 * y2,
    )
    x2 = y2 * i2 - l32 * x3 - l42 * x4 - l52 * x5
    x1 = y1 * i1 - l21 * x2 - l31 * x3 - l41 * x4 - l51 * x5
    x0 = y0 * i0 - l10 * x1 - l20 * x2 - l30 * x3 - l40 * x4 - l50 * x5
    return Wrench(x0, x1, x2, x3, x4, x5)
