"""Attitude: unit quaternion (scalar first, body to inertial), rotation matrix, Euler angles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fish_env.model.jit import kernel
from fish_env.model.records import Rotation, Vector


@kernel
def rotation(qw, qx, qy, qz):
    """R_bI of a unit quaternion: takes body vectors to the inertial frame."""
    return Rotation(
        1.0 - 2.0 * (qy * qy + qz * qz),
        2.0 * (qx * qy - qw * qz),
        2.0 * (qx * qz + qw * qy),
        2.0 * (qx * qy + qw * qz),
        1.0 - 2.0 * (qx * qx + qz * qz),
        2.0 * (qy * qz - qw * qx),
        2.0 * (qx * qz - qw * qy),
        2.0 * (qy * qz + qw * qx),
        1.0 - 2.0 * (qx * qx + qy * qy),
    )


@kernel
def to_inertial(attitude, body):
    """Body vector -> inertial vector: R_bI v."""
    return Vector(
        attitude.xx * body.x + attitude.xy * body.y + attitude.xz * body.z,
        attitude.yx * body.x + attitude.yy * body.y + attitude.yz * body.z,
        attitude.zx * body.x + attitude.zy * body.y + attitude.zz * body.z,
    )


@kernel
def to_body(attitude, inertial):
    """Inertial vector -> body vector: R_bI^T v."""
    return Vector(
        attitude.xx * inertial.x + attitude.yx * inertial.y + attitude.zx * inertial.z,
        attitude.xy * inertial.x + attitude.yy * inertial.y + attitude.zy * inertial.z,
        attitude.xz * inertial.x + attitude.yz * inertial.y + attitude.zz * inertial.z,
    )


@kernel
def cross(a, b):
    """Vector product a x b of two vectors in one frame."""
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@kernel
def quaternion_rate(qw, qx, qy, qz, p, q, r):
    """dq/dt = 1/2 q * [0, omega_body] (1/s)."""
    return (
        -0.5 * (qx * p + qy * q + qz * r),
        0.5 * (qw * p + qy * r - qz * q),
        0.5 * (qw * q + qz * p - qx * r),
        0.5 * (qw * r + qx * q - qy * p),
    )


def euler_from_quaternion(quaternion: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Roll, pitch, yaw (rad, Z-Y-X) of quaternions.

    Args:
        quaternion: shape (..., 4), scalar first, body to inertial; need not be exactly unit.

    Returns:
        Shape (..., 3). Pitch within [-pi/2, pi/2]; roll and yaw within (-pi, pi].
    """
    quaternion = np.asarray(quaternion, float)
    qw, qx, qy, qz = np.moveaxis(
        quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0
    )
    roll = np.arctan2(2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
    pitch = np.arcsin(np.clip(2 * (qw * qy - qx * qz), -1, 1))
    yaw = np.arctan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
    return np.stack([roll, pitch, yaw], axis=-1)


def quaternion_from_euler(euler: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Unit quaternions (scalar first, body to inertial) of roll, pitch, yaw (rad, Z-Y-X).

    Args:
        euler: shape (..., 3).

    Returns:
        Shape (..., 4).
    """
    half = np.asarray(euler, float) / 2
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )
