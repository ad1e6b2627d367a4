"""Runs that are copies of another one but for a little noise, and count as one with it.

Repeats of an experiment have sensor noise of their own. Runs that share it were copied, smoothed or
exported twice, and would make every interval too narrow.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from fish_env.data.schema import Dataset, Run
from fish_env.identification.policy import IDENTIFICATION
from fish_env.rigidbody.interpolation import (
    evenly_spaced,
    interpolator_of,
    windows_of,
    without_turns,
)


def without_copies(dataset: Dataset) -> Dataset:
    """A dataset with one run of each group of copies, and a note of what was left out.

    Args:
        dataset: measured runs.
    """
    kept: dict[str, list[str]] = {}
    copied: set[str] = set()
    for one, other in combinations(dataset.runs, 2):
        if one.id not in copied and other.id not in copied and _copies(one, other):
            kept.setdefault(one.id, []).append(other.id)
            copied.add(other.id)
    if not copied:
        return dataset
    runs = tuple(run for run in dataset.runs if run.id not in copied)
    notes = (
        f"{', '.join(others)} {'has' if len(others) == 1 else 'have'} the sensor noise of run "
        f"{own}: one run, counted once"
        for own, others in kept.items()
    )
    return replace(dataset, runs=runs, notes=(*dataset.notes, *notes))


def _copies(one: Run, other: Run) -> bool:
    """Whether two runs share the noise of every channel, sample by sample."""
    shares = [_difference(one, other, channel) for channel in one.channels]
    known = [share for share in shares if share is not None]
    return bool(known) and max(known) < IDENTIFICATION.copied_noise


def _difference(one: Run, other: Run, channel: str) -> float | None:
    """By how much the noise of two runs differs over that of one; None with too few samples.

    Noise is what neighbours do not predict: the beat, which repeats share, is predicted.
    """
    count = min(len(one.time_s), len(other.time_s))
    even = evenly_spaced(one.time_s[:count])
    own, theirs = (without_turns(channel, run.channels[channel][:count]) for run in (one, other))
    both = np.isfinite(own) & np.isfinite(theirs)
    first, second = (windows_of(np.where(both, a, np.nan), even)[1] for a in (own, theirs))
    known = interpolator_of([first])
    if known is None:
        return None
    noise, apart = known.errors(first), known.errors(first) - known.errors(second)
    return float(np.linalg.norm(apart)) / max(float(np.linalg.norm(noise)), 1e-300)
