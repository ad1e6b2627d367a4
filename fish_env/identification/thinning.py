"""Thinning of fast logs: which rows a fit keeps of samples that come faster than a beat needs.

Each sample costs a step of the filter and memory for its slopes. Of a motion that is known between
samples, more of them only average noise. A late device is followed back through one interval, which
has to be as long as it is late, or nearly.
"""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.identification.policy import IDENTIFICATION

ROUNDING = 0.01
"""Share of an interval by which one that is not quite long enough will do."""
KEPT = 0.8
"""Share of its samples that each channel has to keep, of those expected."""


def kept_rows(clock: FloatArray, measured: FloatArray, quickest_beat_hz: float) -> IntArray:
    """Numbers of the rows to keep, the first among them; all where a channel would lose too much.

    Channels that are sampled in other rows, as by devices with clocks of their own, keep theirs.

    Args:
        clock: (T,) sample times (s).
        measured: (T, C), NaN where missing.
        quickest_beat_hz: highest commanded frequency of the tail (Hz).
    """
    every = np.arange(len(clock))
    sampled = np.isfinite(measured)
    told = np.flatnonzero(sampled.any(axis=1))
    if len(told) < 2:
        return every
    usual = float(np.median(np.diff(clock[told])))
    policy = IDENTIFICATION
    rate = max(policy.enough_samples_per_s, policy.samples_per_beat * quickest_beat_hz)
    stride = int(1.0 / (rate * usual) + ROUNDING)
    if stride < 2:
        return every
    # Counted from each row to the next, as times jitter and rows may be missing.
    count = np.cumsum(np.rint(np.diff(clock[told], prepend=clock[told[0]]) / usual))
    kept = np.union1d([0], told[count % stride == 0])
    enough = KEPT / stride * sampled.sum(axis=0)
    return kept if np.all(sampled[kept].sum(axis=0) >= enough) else every
