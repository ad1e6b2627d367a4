"""Measures of error between a measured and a simulated series, and their plain form for JSON."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data import CHANNELS, OBSERVATIONS, unwrap_angle

UNITS = {"length": "m", "angle": "rad", "speed": "m/s", "rate": "rad/s"}
WINDING = ("roll", "yaw")
"""Angles that may pass the end of their range, where they jump by a turn."""


@dataclasses.dataclass(frozen=True)
class ChannelError:
    """How far a simulated series is from a measured one; errors are simulated minus measured.

    Attributes:
        samples: Measured samples that entered.
        rmse: Root mean square error, in the channel's unit.
        mae: Mean absolute error.
        bias: Mean error.
        fit_percent: 100 (1 - |error| / |measured - its mean|): 100 is perfect, 0 no better than
            the mean; NaN where the measured series is constant.
    """

    samples: int
    rmse: float
    mae: float
    bias: float
    fit_percent: float


def channel_error(measured: FloatArray, simulated: FloatArray) -> ChannelError:
    """Compares two series of shape (n,); samples that are NaN in `measured` stay out."""
    present = np.isfinite(measured)
    truth = measured[present]
    error = simulated[present] - truth
    spread = float(np.linalg.norm(truth - truth.mean()))
    fit = 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0.0 else math.nan
    return ChannelError(
        samples=int(present.sum()),
        rmse=float(np.sqrt(np.mean(error**2))),
        mae=float(np.mean(np.abs(error))),
        bias=float(np.mean(error)),
        fit_percent=fit,
    )


def aligned(
    name: str, measured: FloatArray, simulated: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Both series of a channel so that their difference is an error.

    Angles that wind on are made continuous, and the simulated one starts within half a turn of
    the measured one: a whole turn more or less is no error at the start but is one later.
    """
    if name not in WINDING:
        return measured, simulated
    truth, model = unwrap_angle(measured), unwrap_angle(simulated)
    first = int(np.flatnonzero(np.isfinite(truth))[0])
    turns = np.round((truth[first] - model[first]) / (2.0 * np.pi))
    return truth, model + 2.0 * np.pi * turns


def unit_of(name: str) -> str:
    """SI unit of a channel or observation."""
    return UNITS[(CHANNELS | OBSERVATIONS)[name].dimension]


def plain(value: Any) -> Any:
    """A value as JSON can hold it: dataclasses as objects, arrays as lists, NaN and inf as null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
