"""Named tuples that kernels exchange. All numbers are SI and radians; the frame is in the name.

They cost nothing: the compiler takes them apart into registers.
"""

from __future__ import annotations

from typing import NamedTuple

from fish_env.params.packing import RECORD_FIELDS

Fish = NamedTuple("Fish", [(name, float) for name in RECORD_FIELDS])  # type: ignore[misc]
Fish.__doc__ = "The parameter record of one fish (see fish_env.params.packing)."


class Inputs(NamedTuple):
    """What the actuators do at this instant, and how fast they slew."""

    tail_offset: float
    tail_amplitude: float
    tail_frequency: float
    block_displacement: float
    block_angle: float
    tail_offset_rate: float
    tail_amplitude_rate: float
    tail_frequency_rate: float
    block_displacement_rate: float
    block_angle_rate: float


class Tail(NamedTuple):
    """Tail angle xi1 that the water sees (rad) with its first and second derivative."""

    angle: float
    rate: float
    acceleration: float


class Rotation(NamedTuple):
    """R_bI, row by row: takes body vectors to the inertial frame."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float


class Vector(NamedTuple):
    """Three components; the frame is in the name of the variable."""

    x: float
    y: float
    z: float


class Wrench(NamedTuple):
    """Force (N) and moment about O_b (N m), body frame."""

    fx: float
    fy: float
    fz: float
    mx: float
    my: float
    mz: float


class Barycentre(NamedTuple):
    """Mass properties at the block's position: C_m (m, body), diag(J) about O_b, buoyancy mass."""

    mass: float
    inverse_mass: float
    buoyancy_mass: float
    x: float
    y: float
    z: float
    jx: float
    jy: float
    jz: float


class Motion(NamedTuple):
    """Where the fish is and how it moves, against the ground and against the water.

    ``u, v, w``: velocity of O_b relative to the water, body frame. ``ground_*``: relative to the
    ground. ``water_*``: velocity of the water, body frame; ``water_rate_*``: its acceleration
    along its own path (m/s^2, body frame). ``x, y, z``: position, inertial frame.
    """

    time: float
    x: float
    y: float
    z: float
    u: float
    v: float
    w: float
    p: float
    q: float
    r: float
    ground_u: float
    ground_v: float
    ground_w: float
    water_u: float
    water_v: float
    water_w: float
    water_rate_u: float
    water_rate_v: float
    water_rate_w: float
    attitude: Rotation


class Inertia(NamedTuple):
    """Lower triangle of the symmetric 6x6 mass matrix about O_b: rows V (0..2), omega (3..5)."""

    m00: float
    m10: float
    m11: float
    m20: float
    m21: float
    m22: float
    m30: float
    m31: float
    m32: float
    m33: float
    m40: float
    m41: float
    m42: float
    m43: float
    m44: float
    m50: float
    m51: float
    m52: float
    m53: float
    m54: float
    m55: float
