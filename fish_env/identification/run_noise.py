"""How much noisier the sensors are in some runs than in others, told without any model.

Light, distance and a marker's angle differ from run to run, and so does the noise of what a camera
shows. One noise model for all runs then takes the scatter of a noisy run for a disturbance of the
water. Differences of high order hold hardly any motion, so that they tell the noise of every run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset, Run
from fish_env.data.units import unwrap_angle
from fish_env.identification.channels import usable_channels
from fish_env.identification.noise import noise_differences
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import FREQUENCY
from fish_env.rigidbody.gridded import WINDING
from fish_env.sensing.devices import Device, devices_of

ORDER = 8
"""Of a beat sampled eight times differences of this order leave a thousandth."""
FASTEST = 1.0 / 8.0
"""Beats in a sample interval up to which they tell noise from motion."""


def noise_scales(dataset: Dataset, channels: Sequence[str]) -> dict[str, FloatArray]:
    """By run, its noise over that of the quieter runs, of each channel (C,); one or more.

    Args:
        dataset: measured runs.
        channels: names of the channels.
    """
    found = np.ones((len(dataset.runs), len(channels)))
    devices = np.array(devices_of(channels))
    if all(_slow(run) for run in dataset.runs):
        told = np.array([[_spread(run, n) for n in channels] for run in dataset.runs])
        spreads, counts = told[..., 0], told[..., 1]
        for device in np.unique(devices[devices != Device.DRIVE]).tolist():
            own = devices == device
            found[:, own] = _scales(spreads[:, own], counts[:, own])[:, None]
    return dict(zip(dataset.ids, found, strict=True))


def with_noisy_runs_told(dataset: Dataset) -> Dataset:
    """The dataset with a note that names its noisy runs.

    Args:
        dataset: measured runs.
    """
    scales = noise_scales(dataset, usable_channels(dataset.channels))
    most = {id: float(scale.max(initial=1.0)) for id, scale in scales.items()}
    loud = {id: s for id, s in most.items() if s > IDENTIFICATION.told_noise_scale}
    if not loud:
        return dataset
    named = ", ".join(f"{id} {scale:.2g}" for id, scale in loud.items())
    said = f"Sensors are noisier in some runs; these count for less (noise over the usual): {named}"
    return replace(dataset, notes=(*dataset.notes, said))


def _scales(spreads: FloatArray, counts: FloatArray) -> FloatArray:
    """(R,) noise of runs by that of the quieter ones, shrunk by how badly it is known.

    Runs are as noisy as each other unless they differ by more than chance and by a fifth: a weight
    that is off by less loses hardly anything. Source of the shrinkage: Morris (1983), Journal of
    the American Statistical Association 78, 47.

    Args:
        spreads: (R, C) of the channels of one device; NaN where a run does not tell it.
        counts: (R, C) differences that each is of.
    """
    told = np.isfinite(spreads) & (spreads > 0.0)
    ones = np.ones(len(spreads))
    if told.all(axis=1).sum() < IDENTIFICATION.fewest_runs_for_beats:
        return ones
    usual = np.nanmedian(np.where(told, spreads, np.nan), axis=0)
    logs = np.where(told, np.log(np.where(told, spreads, 1.0) / usual), 0.0)
    share = np.maximum(told.sum(axis=1), 1)
    ratio = logs.sum(axis=1) / share
    variance = np.where(told, _relative_variance() / np.maximum(counts, 1.0), 0.0).sum(axis=1)
    variance = np.where(told.any(axis=1), variance / share**2, np.inf)
    known = np.isfinite(variance)
    between = float(np.var(ratio[known]) - variance[known].mean())
    if between < IDENTIFICATION.least_noise_difference**2:
        return ones
    shrunk = ratio * between / (between + variance)
    quiet = float(np.quantile(shrunk[known], IDENTIFICATION.quiet_runs))
    scale = np.exp(np.where(known, shrunk - quiet, 0.0))
    return np.asarray(np.clip(scale, 1.0, IDENTIFICATION.largest_noise_scale))


def _slow(run: Run) -> bool:
    """Whether all beats of a run are slow beside its samples."""
    fastest = float(np.max(run.commands.values[:, FREQUENCY]))
    return fastest * float(np.median(np.diff(run.time_s))) < FASTEST


def _spread(run: Run, channel: str) -> tuple[float, int]:
    """Spread of a channel's noise, whatever outliers it has, and of how many differences it is.

    NaN where samples are too few.
    """
    values = run.channels[channel]
    values = unwrap_angle(values) if channel in WINDING else values
    found = np.abs(noise_differences(values, ORDER))
    found = found[np.isfinite(found)]
    return (float(np.median(found)) if len(found) > ORDER else np.nan), len(found)


@cache
def _relative_variance() -> float:
    """Variance of the logarithm of a spread times the differences it is of (fixed draws)."""
    normals = np.random.default_rng(0).standard_normal((2000, 200 + ORDER))
    spreads = np.median(np.abs(noise_differences(normals, ORDER)), axis=1)
    return float(200 * np.var(np.log(spreads)))
