"""Samples of late devices in earlier rows: moved by whole rows they are as they were."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.sensing.devices import Device

LATEST_S = 0.1
"""Largest delay of a device by which its samples are moved to earlier rows (s)."""
UNEVEN = 0.02
"""Share of the usual sample interval by which the others may differ for rows to be moved."""


def rows_to_spare(clock: FloatArray) -> int:
    """Rows by which samples may be moved; none where they are not evenly spaced.

    Args:
        clock: (T,) times of the rows (s).
    """
    spans = np.diff(clock)
    usual = float(np.median(spans))
    if np.ptp(spans) > UNEVEN * usual:
        return 0
    return min(int(LATEST_S / usual), len(clock) // 4)


def in_earlier_rows(
    recorded: FloatArray, devices: IntArray, rows: IntArray, most: int
) -> FloatArray:
    """Samples (T, C) moved to earlier rows; the last ones are missing, however far others move.

    Args:
        recorded: (T, C) samples in the rows that their stamps ask for.
        devices: (C,) device of each channel.
        rows: (devices,) by how many rows the samples of each are moved.
        most: rows that are missing at the end.
    """
    seen = recorded.copy()
    kept = len(seen) - most
    for device in np.unique(devices[devices != Device.DRIVE]).tolist():
        own, first = np.flatnonzero(devices == device), int(rows[device])
        seen[:kept, own] = recorded[first : first + kept, own]
        seen[kept:, own] = np.nan
    return np.ascontiguousarray(seen)


def moved_further(of_samples: FloatArray, devices: IntArray, further: IntArray) -> FloatArray:
    """What belongs to samples (T, C), where these are moved again; the ends are repeated.

    Args:
        of_samples: in the rows where the samples are.
        devices: (C,) device of each channel.
        further: (devices,) by how many more rows the samples of each are moved to earlier ones.
    """
    rows = np.arange(len(of_samples))[:, None] + further[devices]
    return np.take_along_axis(of_samples, np.clip(rows, 0, len(of_samples) - 1), axis=0)
