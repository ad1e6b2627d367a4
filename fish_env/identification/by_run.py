"""What many points leave in each run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.runs import RunData


def squares_by_run(rows: FloatArray, runs: Sequence[RunData]) -> FloatArray:
    """Sums of squares (N, R) that N points leave in each of R runs; infinite where one diverges.

    Args:
        rows: (N, D) whitened innovations, run after run.
        runs: the runs.
    """
    ends = np.cumsum([run.measured.size for run in runs])[:-1]
    found = np.column_stack([np.sum(own * own, axis=1) for own in np.split(rows, ends, axis=1)])
    return np.where(np.isfinite(found), found, np.inf)
