"""How sensors sit on the fish and look at it: what mixes channels, or bends one.

A geometry is a mapping of :data:`FIELDS`, zero where a sensor sits and looks as it should. In the
order in which they act, with R the true attitude (body to inertial) and p the place of O_b:

* an attitude sensor mounted askew shows R M and M^T omega, M = R_z(yaw) R_y(pitch) R_x(roll);
* iron about its compass adds iron_sine sin(2 psi) + iron_cosine cos(2 psi) to the yaw psi it shows;
* a marker at r (body) has the place p + R r;
* a camera that is tilted shows its x and y along its own axes, T^T (p + R r), T = R_y R_x;
* a camera above water of refractive index n, at a height h, has been calibrated at the depth d0:
  its x and y are (1 + kappa d0) / (1 + kappa z) as large, kappa = refraction = 1 / (n h).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray

MOUNT = ("mount_roll", "mount_pitch", "mount_yaw")
CAMERA = ("marker_x", "marker_y", "marker_z", "tilt_roll", "tilt_pitch", "refraction")
FIELDS = (*MOUNT, *CAMERA, "iron_sine", "iron_cosine")
"""rad, m, rad, 1/m, rad."""
CALIBRATED_DEPTH = 0.5
"""m. Depth at which the scale of a camera above the water is right."""
ANGLES, RATES, PLACE = ("roll", "pitch", "yaw"), ("p", "q", "r"), ("x", "y", "z")
LENS_ROWS = 22
"""Numbers of a lens: M (9, by rows), the marker (3), two rows of T^T (6), kappa, 1 + kappa d0, and
the sine and cosine of the iron."""

Geometry = Mapping[str, npt.ArrayLike]


def turns_of(roll: npt.ArrayLike, pitch: npt.ArrayLike, yaw: npt.ArrayLike) -> FloatArray:
    """Rotation matrices R_z(yaw) R_y(pitch) R_x(roll), shape (3, 3, ...)."""
    angles = np.broadcast_arrays(*(np.asarray(a, float) for a in (roll, pitch, yaw)))
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def lens_of(geometry: Geometry, count: int) -> FloatArray:
    """The geometry of ``count`` lanes as kernels read it, shape (LENS_ROWS, count)."""
    given = [geometry.get(name, 0.0) for name in FIELDS]
    value = dict(zip(FIELDS, (np.broadcast_to(v, (count,)) for v in given), strict=True))
    mount = turns_of(*(value[name] for name in MOUNT))
    tilt = turns_of(value["tilt_roll"], value["tilt_pitch"], 0.0)
    marker = [value[f"marker_{axis}"] for axis in PLACE]
    bent = value["refraction"]
    rest = [bent, 1.0 + bent * CALIBRATED_DEPTH, value["iron_sine"], value["iron_cosine"]]
    return np.concatenate(
        [mount.reshape(9, count), marker, tilt[:, 0], tilt[:, 1], rest], dtype=np.float64
    )


def through_geometry(
    channels: Mapping[str, FloatArray], geometry: Geometry
) -> dict[str, FloatArray]:
    """True channels as sensors of this geometry show them.

    Args:
        channels: true channels (SI), each of shape (...) or (..., n). What is missing is not
            invented, nor is what it would take to know it.
        geometry: numbers, or arrays of shape (n,).

    Returns:
        The same channels. Yaw goes round as often as the true one.
    """
    seen = dict(channels)
    value = {name: np.asarray(geometry.get(name, 0.0), float) for name in FIELDS}
    if not all(name in channels for name in ANGLES):
        return seen
    by_camera = all(name in channels for name in PLACE) and _any(value, CAMERA)
    mounted = _any(value, MOUNT)
    if by_camera or mounted:
        turns = turns_of(*(channels[name] for name in ANGLES))
        seen |= _by_camera(channels, turns, value) if by_camera else {}
        seen |= _mounted(channels, turns, value) if mounted else {}
    if np.any(value["iron_sine"]) or np.any(value["iron_cosine"]):
        double = 2.0 * seen["yaw"]
        iron = value["iron_sine"] * np.sin(double) + value["iron_cosine"] * np.cos(double)
        seen["yaw"] = seen["yaw"] + iron
    return seen


def _any(value: Mapping[str, FloatArray], names: Iterable[str]) -> bool:
    return any(np.any(value[name]) for name in names)


def _mounted(
    channels: Mapping[str, FloatArray], turns: FloatArray, value: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    mount = turns_of(*(value[name] for name in MOUNT))
    shown = np.einsum("ij...,jk...->ik...", turns, mount)
    yaw = np.arctan2(shown[1, 0], shown[0, 0])
    round_about = 2.0 * np.pi * np.round((channels["yaw"] - yaw) / (2.0 * np.pi))
    seen = {
        "roll": np.arctan2(shown[2, 1], shown[2, 2]),
        "pitch": -np.arcsin(np.clip(shown[2, 0], -1.0, 1.0)),
        "yaw": yaw + round_about,
    }
    if all(name in channels for name in RATES):
        rates = np.stack([channels[name] for name in RATES])
        turned = np.einsum("ji...,j...->i...", mount, rates)
        seen |= dict(zip(RATES, turned, strict=True))
    return seen


def _by_camera(
    channels: Mapping[str, FloatArray], turns: FloatArray, value: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """x and y; the depth is not the camera's."""
    marker = [value[f"marker_{axis}"] for axis in PLACE]
    place = [
        channels[axis] + sum(turns[i, j] * marker[j] for j in range(3))
        for i, axis in enumerate(PLACE)
    ]
    tilt = turns_of(value["tilt_roll"], value["tilt_pitch"], 0.0)
    bent = value["refraction"]
    size = (1.0 + bent * CALIBRATED_DEPTH) / (1.0 + bent * np.maximum(channels["z"], 0.0))
    return {
        axis: np.asarray(size * sum(tilt[i, k] * place[i] for i in range(3)))
        for k, axis in enumerate("xy")
    }
