"""Metrics of paths and places, in addition to those of all tasks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fish_env.arrays import FloatArray
from robofish_agents.evaluation.metrics import LATE_S, measure
from robofish_agents.evaluation.record import Record


def _rms(record: Record, key: str, late: bool = False) -> FloatArray:
    """Root mean square of an error over the episode, or over its last 10 s (N,)."""
    steps = round(LATE_S / record.period_s) if late else len(record.info[key])
    return np.asarray(np.sqrt(np.mean(record.info[key][-steps:] ** 2, axis=0)))


GOAL_METRICS: dict[str, dict[str, Callable[[Record], FloatArray]]] = {
    "path": {
        "cross_track_rmse_m": lambda record: _rms(record, "cross_track_error"),
        "cross_track_late_rmse_m": lambda record: _rms(record, "cross_track_error", late=True),
        "path_progress": lambda record: record.info["path_progress"][-1],
    },
    "station": {
        "place_rmse_m": lambda record: _rms(record, "place_error"),
        "place_late_rmse_m": lambda record: _rms(record, "place_error", late=True),
    },
}
"""Task -> metric -> function to one number an episode, (N,)."""


def measure_task(record: Record, task: str) -> dict[str, FloatArray]:
    """Returns all metrics of a task, each (N,); NaN where one does not apply to an episode."""
    own = {name: function(record) for name, function in GOAL_METRICS.get(task, {}).items()}
    return measure(record, task) | own
