"""What differs between runs of one fish, and how a run's own numbers enter its simulation.

Sizes are those of a robot that is opened, trimmed and closed again between runs: a weight block
put back a tenth of a millimetre aside moves the barycentre by that much, a bubble carries a few
tenths of a gram, a gyro's zero moves with its temperature, and a camera and a logger are started
by hand. A battery slows the tail by what is left of its charge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.refraction import INDEX
from fish_env.identification.channels import from_above
from fish_env.identification.policy import IDENTIFICATION
from fish_env.inference.estimate.run_variation import CommonEffect, RunVariation
from fish_env.inference.hypotheses import EffectParameterId as Shared
from fish_env.params.packing import RECORD_FIELDS
from fish_env.sensing.devices import Device, devices_of
from fish_env.sensing.geometry import ANGLES

USUAL_BEAT, USUAL_SAG = IDENTIFICATION.ordinary_beat_error, 3e-4
"""Ordinary spreads over runs of servos' frequencies, and of what batteries lose each second (1/s).
Within these a beat that runs share is none: a narrower spread about what combs have found would
take the mean of their errors for a cause."""
VARIATIONS = (
    RunVariation("trim_x", "m", 1e-4, beside=Shared("com_offset", "x")),
    RunVariation("trim_y", "m", 1e-4, beside=Shared("com_offset", "y")),
    RunVariation("trim_z", "m", 1e-4, beside=Shared("com_offset", "z")),
    RunVariation("buoyancy", "kg", 4e-4, beside=Shared("buoyancy_offset", "mass")),
    RunVariation("gyro_zero_p", "rad/s", 5e-3, beside=Shared("gyro_bias", "p")),
    RunVariation("gyro_zero_q", "rad/s", 5e-3, beside=Shared("gyro_bias", "q")),
    RunVariation("gyro_zero_r", "rad/s", 5e-3, beside=Shared("gyro_bias", "r")),
    RunVariation("clock_offset", "s", 1e-2, beside=Shared("sensor_delay", "delay")),
    RunVariation("beat", "1", USUAL_BEAT, beside=Shared("frequency_scale", "scale")),
    RunVariation("beat_sag", "1/s", USUAL_SAG, beside=Shared("battery_sag", "rate")),
    RunVariation("camera_delay", "s", 0.02, shared=True, positive=True),
    RunVariation("inertial_delay", "s", 0.03, shared=True, positive=True),
    RunVariation("depth_delay", "s", 0.02, shared=True, positive=True),
    RunVariation("start_phase", "rad", 0.2),
    RunVariation("wave_phase", "rad", 1.8, beside=Shared("wave", "phase")),
)
"""Trim is how far the barycentre of the whole fish at rest is moved. The beat and its sag are
beside what combs have found, see ``own_beats``. Devices are late by a frame of a camera; a filter
of 5 Hz inside an inertial unit makes that 0.045 s late. The phase is that of the tail at the first
sample, beside what is declared or was found on a grid: it moves with the delays. A wave meets each
run in another phase: numbers that are even over a circle have a spread of 1.8 rad."""
COUNT = len(VARIATIONS)
BEAT, SAG, START, WAVE = (
    next(i for i in range(COUNT) if VARIATIONS[i].name == name)
    for name in ("beat", "beat_sag", "start_phase", "wave_phase")
)
DEGREE = float(np.deg2rad(1.0))
SENSOR_ERRORS = (
    *(
        RunVariation(f"marker_{a}", "m", 0.01, shared=True, beside=Shared("marker_offset", a))
        for a in "xyz"
    ),
    *(
        RunVariation(
            f"mounting_{a}", "rad", DEGREE, shared=True, beside=Shared("attitude_misalignment", a)
        )
        for a in ANGLES
    ),
    *(
        RunVariation(f"gyro_gain_{a}", "1", 0.01, shared=True, beside=Shared("gyro_scale", a))
        for a in "pqr"
    ),
    RunVariation("compass_sin_yaw", "rad", DEGREE, shared=True),
    RunVariation("compass_cos_yaw", "rad", DEGREE, shared=True),
    RunVariation("compass_sin_2_yaw", "rad", DEGREE, shared=True),
    RunVariation("compass_cos_2_yaw", "rad", DEGREE, shared=True),
    *(
        RunVariation(f"camera_{a}", "rad", DEGREE, shared=True, beside=Shared("camera_tilt", a))
        for a in ("roll", "pitch")
    ),
    RunVariation("camera_scale_per_depth", "1/m", 0.15, shared=True),
    RunVariation("inertial_smoothing", "1", 1.0, shared=True, positive=True),
    RunVariation("current_north", "m/s", 4e-3, beside=Shared("current", "north")),
    RunVariation("current_east", "m/s", 4e-3, beside=Shared("current", "east")),
)
"""Usual sizes: a centimetre, a degree, one per cent, all that a low-pass of 5 Hz inside an inertial
unit takes away beside making it late; the picture of a camera some metres above the water shrinks
with depth, by the refractive index and its height. Water that drifts carries the fish along: to the
sensors it is as if their frame moved."""
CURRENT = tuple(
    next(i for i, error in enumerate(SENSOR_ERRORS) if error.name == f"current_{axis}")
    for axis in ("north", "east")
)
GEOMETRY = {
    "marker_x": "marker_x",
    "marker_y": "marker_y",
    "marker_z": "marker_z",
    "mounting_roll": "mount_roll",
    "mounting_pitch": "mount_pitch",
    "mounting_yaw": "mount_yaw",
    "compass_sin_2_yaw": "iron_sine",
    "compass_cos_2_yaw": "iron_cosine",
    "camera_roll": "tilt_roll",
    "camera_pitch": "tilt_pitch",
    "camera_scale_per_depth": "refraction",
}
"""Sensor errors that are geometry, and its fields (see ``sensing.geometry``): a run's own come on
top of what all runs share."""
GYRO_GAINS = {f"gyro_gain_{axis}": axis for axis in "pqr"}
IN_SAMPLES = np.array(
    [error.name not in GEOMETRY and error.name not in GYRO_GAINS for error in SENSOR_ERRORS]
)
"""(K,) whether an error is taken off the samples: what sensors make of a state cannot tell it."""
EVERY = (*VARIATIONS, *SENSOR_ERRORS)


def _alike(
    effect: str, numbers: Sequence[str], names: Sequence[str], neutral: float = 0.0
) -> CommonEffect:
    """An effect whose parameters depart from neutral by what runs share of one number each."""

    def values(shared: Sequence[float]) -> dict[str, float]:
        return {name: neutral + value for name, value in zip(names, shared, strict=True)}

    return CommonEffect(effect, tuple(numbers), values)


def _late(shared: Sequence[float]) -> dict[str, float]:
    clock, camera, depth, inertial = shared
    of_all = max(min(camera, depth, inertial), 0.0)
    later = {"camera_later": camera - of_all, "depth_later": depth - of_all}
    return {"delay": max(clock + of_all, 0.0), **later}


def _iron(shared: Sequence[float]) -> dict[str, float]:
    sine, cosine = shared
    return {"amplitude": math.hypot(sine, cosine), "angle": math.atan2(cosine, sine)}


def _bent(shared: Sequence[float]) -> dict[str, float] | None:
    (per_metre,) = shared
    return {"height": 1.0 / (INDEX * per_metre)} if per_metre > 0.0 else None


COMMON = (
    CommonEffect(
        "sensor_delay", ("clock_offset", "camera_delay", "depth_delay"), _late, ("inertial_delay",)
    ),
    _alike("marker_offset", [f"marker_{axis}" for axis in "xyz"], "xyz"),
    _alike("attitude_misalignment", [f"mounting_{name}" for name in ANGLES], ANGLES),
    _alike("camera_tilt", ("camera_roll", "camera_pitch"), ("roll", "pitch")),
    _alike("gyro_scale", [f"gyro_gain_{axis}" for axis in "pqr"], "pqr", 1.0),
    CommonEffect("soft_iron", ("compass_sin_2_yaw", "compass_cos_2_yaw"), _iron),
    CommonEffect("refraction", ("camera_scale_per_depth",), _bent),
    _alike("gyro_bias", [f"gyro_zero_{axis}" for axis in "pqr"], "pqr"),
    _alike("buoyancy_offset", ("buoyancy",), ("mass",)),
    _alike("current", ("current_north", "current_east"), ("north", "east")),
    _alike("battery_sag", ("beat_sag",), ("rate",)),
    _alike("frequency_scale", ("beat",), ("scale",), 1.0),
    CommonEffect(
        "clock_scale",
        ("beat", *GYRO_GAINS),
        lambda shared: {"scale": 1.0 + shared[0]},
        rates=(1.0, -1.0, -1.0, -1.0),
    ),
)
"""What is wrong in all runs alike. Runs keep delays of their inertial unit, but for what all
devices share: a filter inside it delays no other. In the seconds of a slow clock the tail beats
more often, and gyros show too little."""
USUAL = np.array([variation.usual for variation in EVERY])
_MASS, _BUOYANCY = RECORD_FIELDS.index("mass_total"), RECORD_FIELDS.index("mass_buoyancy")
_STATIC = {f"trim_{axis}": RECORD_FIELDS.index(f"static_{axis}") for axis in "xyz"}
_GYROS = {"gyro_zero_p": "p", "gyro_zero_q": "q", "gyro_zero_r": "r"}
_INDEX = {variation.name: i for i, variation in enumerate(VARIATIONS)}
_DELAYS = {
    Device.CAMERA: "camera_delay",
    Device.INERTIAL: "inertial_delay",
    Device.DEPTH: "depth_delay",
}


def varied_records(records: FloatArray, own: FloatArray, wave_row: int | None) -> FloatArray:
    """Parameter records (parameters, N) with a run's own numbers (K, N or 1) added.

    Args:
        records: what all runs share.
        own: the run's numbers.
        wave_row: of the phase of the wave; None where the kernel computes none.
    """
    moved = records.copy()
    if wave_row is not None:
        moved[wave_row] += own[WAVE]
    for name, row in _STATIC.items():
        moved[row] += own[_INDEX[name]] * records[_MASS]
    moved[_BUOYANCY] += own[_INDEX["buoyancy"]]
    return moved


def unseen(channels: Sequence[str]) -> list[int]:
    """Numbers of runs that none of the channels would show: they stay zero, and nobody is told."""
    devices = devices_of(channels)
    hidden = [_INDEX[_DELAYS[device]] for device in _DELAYS if device not in devices]
    if not from_above(channels):
        return hidden
    return [i for name, i in _INDEX.items() if name.startswith(("trim_", "buoyancy"))] + hidden


def varied_bias(bias: FloatArray, own: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Offsets of the channels (C, N) with a run's own gyro zeros (K, N or 1) added."""
    moved = bias.copy()
    for name, channel in _GYROS.items():
        if channel in channels:
            moved[list(channels).index(channel)] += own[_INDEX[name]]
    return moved


def varied_gain(gain: FloatArray, errors: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Factors of the channels (C, N) with a run's own gains of its gyro (K,)."""
    moved = gain.copy()
    for error, value in zip(SENSOR_ERRORS, errors.tolist(), strict=True):
        if GYRO_GAINS.get(error.name) in channels:
            moved[list(channels).index(GYRO_GAINS[error.name])] *= 1.0 + value
    return moved


def varied_geometry(
    geometry: Mapping[str, FloatArray], errors: FloatArray, count: int
) -> dict[str, FloatArray]:
    """How sensors sit and look, each field (N,), with a run's own errors (K,) added.

    Args:
        geometry: what all runs share.
        errors: the run's own.
        count: N.
    """
    varied = dict(geometry)
    for error, value in zip(SENSOR_ERRORS, errors.tolist(), strict=True):
        field = GEOMETRY.get(error.name)
        if field is not None and value != 0.0:
            varied[field] = np.full(count, value) + varied.get(field, 0.0)
    return varied


def device_ages(own: FloatArray) -> FloatArray:
    """How late each device is (devices, N) by a run's own numbers (K, N) (s)."""
    ages = np.zeros((len(Device), *own.shape[1:]))
    for device, name in _DELAYS.items():
        ages[device] = own[_INDEX[name]]
    return ages


def varied_delay(delay: FloatArray, own: FloatArray) -> FloatArray:
    """Age of the samples (N,) with a run's own clock offset (K, N or 1) added (s)."""
    return np.asarray(delay + own[_INDEX["clock_offset"]])
