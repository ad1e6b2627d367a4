"""Effects of imperfect measurement: what the recorder's clock and sensors do to true channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.effects.extended import ExtendedModel
from fish_env.model.effect import Effect
from fish_env.sensing.devices import Device, devices_of, late_s
from fish_env.sensing.geometry import through_geometry


def true_times(model: ExtendedModel, recorded_s: npt.ArrayLike) -> FloatArray:
    """True times (s) of the states that a recording with these time stamps shows."""
    times = np.asarray(recorded_s, float)
    for effect in model.measurement:
        if effect.sample_time is not None:
            times = effect.sample_time(times, model.effects[effect.name])
    return times


def ages_s(model: ExtendedModel, names: Sequence[str]) -> dict[str, float]:
    """How much older each channel is than its true time says (s), by the device that records it."""
    ages = np.zeros(len(Device))
    for effect in model.measurement:
        ages += device_ages_s(effect, model.effects[effect.name])
    devices = zip(names, devices_of(names), strict=True)
    return {name: float(ages[device]) for name, device in devices}


def device_ages_s(
    effect: Effect, values: Mapping[str, npt.ArrayLike], count: int = 0
) -> FloatArray:
    """How much older an effect makes what each device records (s), (devices,).

    Args:
        effect: the effect.
        values: its parameters.
        count: number of lanes if the parameters are arrays (count,); the result is (devices,
            count).
    """
    ages = np.zeros((len(Device), count) if count else len(Device))
    for device, seconds in effect.late(values).items() if effect.late is not None else ():
        ages[Device[device.upper()]] += seconds
    if effect.low_pass is not None:
        ages[Device.INERTIAL] += late_s(effect.low_pass(values))
    return ages


def true_command_times(model: ExtendedModel, recorded_s: npt.ArrayLike) -> FloatArray:
    """True times (s) at which commands were given that a recording gives these time stamps."""
    times = np.asarray(recorded_s, float)
    for effect in model.measurement:
        if effect.command_time is not None:
            times = effect.command_time(times, model.effects[effect.name])
    return times


def measured_channels(
    model: ExtendedModel, channels: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """True channels (SI) as the model's sensors report them: their geometry, then their scales."""
    measured = dict(channels)
    geometry: dict[str, float] = {}
    for effect in model.measurement:
        if effect.geometry is not None:
            geometry |= effect.geometry(model.effects[effect.name])
    if geometry:
        measured = through_geometry(measured, geometry)
    for effect in model.measurement:
        if effect.measure is not None:
            measured = effect.measure(measured, model.effects[effect.name])
    return measured
