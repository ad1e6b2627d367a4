"""What the checks for any vehicle need to know of a fish's measured runs."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset, Run
from fish_env.data.units import SI_UNIT
from fish_env.data.vocabulary import CHANNELS, COMMANDS
from fish_env.identification.command_jumps import jump_times
from fish_env.rigidbody.recording import RecordedRun, Recording

_BLOCK = [i for i, name in enumerate(COMMANDS) if name.startswith("block_")]
_AMPLITUDE = list(COMMANDS).index("tail_amplitude")


def recorded(dataset: Dataset) -> Recording:
    """A dataset as the checks for any vehicle read it."""
    units = {name: SI_UNIT[CHANNELS[name].dimension] for name in dataset.channels}
    return Recording(dataset.name, tuple(map(recorded_run, dataset.runs)), units, dataset.noise)


def recorded_run(run: Run) -> RecordedRun:
    """A run as the checks for any vehicle read it.

    A move of the block jerks the hull. Nothing drives the fish while its tail does not beat.
    """
    steps = run.commands
    moves = np.any(np.diff(steps.values[:, _BLOCK], axis=0) != 0.0, axis=1)
    from_rest = run.start == "rest"
    repeats = (run.condition, run.tail_phase) if from_rest and run.condition is not None else None
    return RecordedRun(
        run.id,
        run.time_s,
        run.channels,
        steps.times_s,
        steps.times_s[1:][moves],
        _still_stretches(run),
        jump_times(steps.times_s, steps.values),
        from_rest,
        repeats,
    )


def _still_stretches(run: Run) -> FloatArray:
    """Begin and end of stretches in which the tail is asked to keep still, s, shape (k, 2)."""
    still = run.commands.values[:, _AMPLITUDE] == 0.0
    edges = np.append(run.commands.times_s, run.time_s[-1])
    turns = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    return edges[turns].reshape(-1, 2)
