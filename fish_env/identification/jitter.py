"""How fast channels change: what a sample that is taken early or late gets wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.rigidbody.interpolation import without_turns
from fish_env.rigidbody.sample_times import rate_of


def channel_rates(clock: FloatArray, measured: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Rates of change (T, C) of measured channels (SI per second).

    Args:
        clock: (T,) sample times (s).
        measured: (T, C), NaN where missing.
        channels: names of the channels (C,).
    """
    series = zip(channels, measured.T, strict=True)
    return np.column_stack([rate_of(clock, without_turns(name, own)) for name, own in series])
