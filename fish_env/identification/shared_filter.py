"""A low-pass inside the inertial unit that all runs share: what it does beside making samples late.

A Kalman filter has no state for it. What it takes off follows from the motion, and is put back to
the samples; slopes by its cutoff go through the filter's own slopes, as those of sensor errors do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.predicted_motion import Motion, predicted_motion
from fish_env.identification.runs import RunData
from fish_env.identification.sensor_errors import innovation_slopes
from fish_env.sensing.devices import Device, devices_of


def smoothing(run: RunData, motion: Motion, channels: Sequence[str]) -> FloatArray:
    """What the low-pass that all runs share does to samples (T, C) beside making them late.

    Args:
        run: the run.
        motion: its motion.
        channels: names of its C channels.
    """
    found = np.zeros((len(run.clock), len(channels)))
    if not run.is_smoothed:
        return found
    age = float(run.own_ages[Device.INERTIAL])
    for i, (name, device) in enumerate(zip(channels, devices_of(channels), strict=True)):
        if device == Device.INERTIAL:
            found[:, i] = motion.filtered(name, age, run.cutoff_hz)
    return found


def by_other_filters(
    runs: Sequence[RunData],
    filtered: Sequence[Filtered],
    channels: Sequence[str],
    correlation_s: float,
    cutoffs_hz: FloatArray,
) -> FloatArray:
    """What other low-passes would take off whitened innovations (N, D), beside making samples late.

    Args:
        runs: runs whose samples follow the motion.
        filtered: each of them filtered, with its slopes.
        channels: names of their C channels.
        correlation_s: of the disturbance that they were filtered with (s).
        cutoffs_hz: (N,) of the other low-passes.

    Raises:
        ValueError: a filter kept no slopes.
        LinAlgError: the simulation has diverged.
    """
    distinct, which = np.unique(cutoffs_hz, return_inverse=True)
    parts = []
    for run, one in zip(runs, filtered, strict=True):
        motion = predicted_motion(run.clock, one)
        others = [smoothing(run.with_cutoff(c), motion, channels) for c in distinct.tolist()]
        changes = np.stack(others, axis=2) - smoothing(run, motion, channels)[:, :, None]
        parts.append(innovation_slopes(run.clock, run.measured, one, correlation_s, changes))
    return np.asarray(np.concatenate(parts).T[which])
