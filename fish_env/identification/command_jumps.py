"""When commands jump: steps are fine for a moment after, and gyros with a filter show it late."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.data.vocabulary import COMMANDS

SAME_INSTANT_S = 1e-6
SWITCH_S = 0.04
"""After a jump of the commands a servo may move its tail as fast as it can: steps are fine."""
JUMPS = {
    "tail_offset": 0.02,
    "tail_amplitude": 0.02,
    "tail_frequency": 0.15,
    "block_displacement": 0.005,
    "block_angle": 0.05,
}
"""Larger changes (rad, Hz, m) are jumps. Smaller ones, as of commands that glide and are logged
with every sample, leave plain steps wrong by less than a fifth of usual sensor noise."""


def jumped(commands: FloatArray) -> BoolArray:
    """Which switches (m,) of commands (m, 5) are jumps; the first one comes out of the unknown."""
    least = np.array([JUMPS[name] for name in COMMANDS])
    large = np.abs(np.diff(commands, axis=0)) > least
    return np.concatenate([[True], large.any(axis=1)])


def jump_times(times_s: FloatArray, values: FloatArray) -> FloatArray:
    """Times (k,) at which commands jump, s.

    Args:
        times_s: (m,) times from which each row of commands holds, s.
        values: (m, 5) commands, SI.
    """
    return times_s[jumped(values)]


def just_after(switches: FloatArray, clock: FloatArray) -> BoolArray:
    """Whether the interval before each sample lies, in part, in the moment after a jump."""
    last = np.searchsorted(switches, clock - SAME_INSTANT_S) - 1
    begin = np.concatenate([clock[:1], clock[:-1]])
    since = begin - switches[np.maximum(last, 0)]
    return (last >= 0) & (since < SWITCH_S - SAME_INSTANT_S)


def soon_after(
    commands: tuple[FloatArray, FloatArray], clock: FloatArray, for_s: float
) -> BoolArray:
    """Which samples (T,) come within some time (s) of a jump, at it or after it.

    Args:
        commands: (m,) times from which each row of commands holds (s), and (m, 5) commands, SI.
        clock: (T,) sample times (s).
        for_s: how long.
    """
    since = clock[:, None] - jump_times(*commands)
    return np.asarray(((since >= 0.0) & (since < for_s)).any(axis=1))
