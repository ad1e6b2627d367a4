"""Effects of imperfect measurement: what the recorder's clock and sensors do to true channels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.effects.extended import ExtendedModel


def true_times(model: ExtendedModel, recorded_s: npt.ArrayLike) -> FloatArray:
    """True times (s) of the states that a recording with these time stamps shows."""
    times = np.asarray(recorded_s, float)
    for effect in model.measurement:
        if effect.sample_time is not None:
            times = effect.sample_time(times, model.effects[effect.name])
    return times


def measured_channels(
    model: ExtendedModel, channels: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """True channels (SI) as the model's sensors report them."""
    measured = dict(channels)
    for effect in model.measurement:
        if effect.measure is not None:
            measured = effect.measure(measured, model.effects[effect.name])
    return measured
