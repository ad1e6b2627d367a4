"""Attitude measured as a quaternion, read into Euler angles."""

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.place import Place
from fish_env.data.vocabulary import QUATERNION

NORM_TOLERANCE = 0.01
"""How far the norm may be from one: rounding to two decimals, but no wrong column."""


TILTED, UPRIGHT = 0.7, 0.9
"""Cosines of the tilt that most of a run exceeds if the fish is not, or is, upright."""


def euler_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Converts unit quaternions to Z-Y-X Euler angles.

    With R(q) = Rz(yaw) Ry(pitch) Rx(roll), the third row of R is
    (-sin pitch, cos pitch sin roll, cos pitch cos roll) and its first column holds
    (cos pitch cos yaw, cos pitch sin yaw).

    Args:
        quaternion: Scalar first, body to inertial, shape (n, 4); NaN rows stay NaN.

    Returns:
        Roll, pitch, yaw, shape (n, 3), rad; roll and yaw within (-pi, pi].
    """
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.column_stack([roll, pitch, yaw])


def check_quaternion(quaternion: FloatArray, rows: list[int], place: Place) -> None:
    """Refuses half-measured quaternions, norms away from one, and a scalar in the last column.

    Args:
        quaternion: Shape (n, 4), NaN where missing.
        rows: Line of the file of each sample.
        place: The file and run.

    Raises:
        DatasetError: At the first sample that is wrong.
    """
    missing = np.isnan(quaternion)
    partial = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
    if partial.size:
        raise place.at(rows[partial[0]], ",".join(QUATERNION)).refuse(
            "part of the quaternion is missing", "Give all four cells, or leave all four empty"
        )
    norm = np.linalg.norm(quaternion, axis=1)
    wrong = np.flatnonzero(np.abs(norm - 1.0) > NORM_TOLERANCE)
    if wrong.size:
        raise place.at(rows[wrong[0]], ",".join(QUATERNION)).refuse(
            f"the quaternion has norm {norm[wrong[0]]:.4g}, not 1",
            "Correct the row; the order is qw, qx, qy, qz, body to inertial",
        )
    _check_order(quaternion, place)


def _check_order(quaternion: FloatArray, place: Place) -> None:
    """Refuses a fish that lies on its side or back unless the scalar is taken from the end."""
    declared = 1.0 - 2.0 * np.sum(quaternion[:, 1:3] ** 2, axis=1)
    scalar_last = 1.0 - 2.0 * np.sum(quaternion[:, 0:2] ** 2, axis=1)
    if np.nanmedian(declared) < TILTED and np.nanmedian(scalar_last) > UPRIGHT:
        raise place.at(column=",".join(QUATERNION)).refuse(
            "as declared the fish swims on its side or back; with the scalar as the last of the "
            "four it swims upright",
            "Name the columns so that qw is the scalar; the order is qw, qx, qy, qz",
        )
