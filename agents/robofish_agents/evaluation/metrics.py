"""Metrics of an episode, as `docs/evaluation.md` defines them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from robofish_agents.evaluation.record import Record

LATE_S = 10.0
"""Length of the end of an episode over which lasting errors are taken (s)."""
STEP_RESPONSE_TASK = "hold"


def success_rate(record: Record) -> FloatArray:
    """Returns 1 where the episode was complete and its last 10 s were within all limits."""
    return np.asarray(record.info["is_success"][-1] * record.alive[-1])


def failure_rate(record: Record) -> FloatArray:
    """Returns 1 where the fish left the tank or tumbled, or the simulation diverged."""
    return np.asarray(record.info["failure"][-1] > 0, float)


def _rms(values: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def _late(record: Record, key: str) -> FloatArray:
    return record.info[key][-round(LATE_S / record.period_s) :]


def _mean_alive(values: FloatArray, record: Record) -> FloatArray:
    return np.asarray((values * record.alive).sum(axis=0) / record.alive.sum(axis=0))


def cost_of_transport(record: Record) -> FloatArray:
    """Energy of the tail servo over weight times way; the way is surge speed (over a beat) x time.

    NaN where the fish got nowhere.
    """
    energy = (record.info["power"] * record.alive).sum(axis=0)
    way = (record.info["speed"] * record.alive).sum(axis=0)
    return np.where(way > 0, energy / (record.weight * np.where(way > 0, way, 1.0)), np.nan)


def action_change(record: Record) -> FloatArray:
    """Returns the mean absolute change of an action between steps; 2 is the whole range."""
    change = np.abs(np.diff(record.actions, axis=0)).mean(axis=2)
    both = record.alive[1:]
    return np.asarray((change * both).sum(axis=0) / np.maximum(both.sum(axis=0), 1))


def _begins_outside(record: Record, channel: str) -> BoolArray:
    first = record.first[f"{channel}_error"]
    return np.asarray(np.abs(first) > record.limits[channel])


def _errors(record: Record, channel: str) -> FloatArray:
    """Errors (T + 1, N) relative to the first one, which is 1."""
    first = record.first[f"{channel}_error"]
    series = np.concatenate([first[None], record.info[f"{channel}_error"]])
    return np.asarray(series / np.where(first == 0, 1.0, first))


def _first_time(reached: BoolArray) -> FloatArray:
    """Index of the first True in each column; the length where there is none."""
    return np.where(reached.any(axis=0), reached.argmax(axis=0), len(reached) - 1).astype(float)


def rise(record: Record, channel: str) -> FloatArray:
    """Time from 90 % of the first error to 10 % (s); never: the whole episode.

    NaN where the episode begins within the success limit of the channel.
    """
    errors = _errors(record, channel)
    steps = _first_time(errors <= 0.1) - _first_time(errors <= 0.9)
    late = ~(errors <= 0.1).any(axis=0)
    seconds = np.where(late, len(errors) - 1, steps) * record.period_s
    return np.where(_begins_outside(record, channel), seconds, np.nan)


def settling(record: Record, channel: str) -> FloatArray:
    """Time after which the error stays within the success limit (s); never: the whole episode."""
    errors = np.abs(record.info[f"{channel}_error"])
    outside = (errors > record.limits[channel]) | ~record.alive
    last = len(errors) - outside[::-1].argmax(axis=0)
    steps = np.where(outside.any(axis=0), np.minimum(last + 1, len(errors)), 1)
    return np.where(_begins_outside(record, channel), steps * record.period_s, np.nan)


def overshoot(record: Record, channel: str) -> FloatArray:
    """Returns the largest error of the other sign, as a share of the first error."""
    beyond = np.maximum(0.0, -_errors(record, channel).min(axis=0))
    return np.where(_begins_outside(record, channel), beyond, np.nan)


METRICS: dict[str, Callable[[Record], FloatArray]] = {
    "success_rate": success_rate,
    "failure_rate": failure_rate,
    "depth_rmse_m": lambda record: _rms(record.info["depth_error"]),
    "heading_rmse_rad": lambda record: _rms(record.info["heading_error"]),
    "speed_rmse_m_per_s": lambda record: _rms(record.info["speed_error"]),
    "depth_late_rmse_m": lambda record: _rms(_late(record, "depth_error")),
    "heading_late_rmse_rad": lambda record: _rms(_late(record, "heading_error")),
    "mean_power_w": lambda record: _mean_alive(record.info["power"], record),
    "cost_of_transport": cost_of_transport,
    "action_change": action_change,
    "episode_return": lambda record: record.reward.sum(axis=0),
}
"""Metric -> function to one number an episode, (N,); on both tasks."""
STEP_METRICS: dict[str, Callable[[Record], FloatArray]] = {
    "depth_rise_s": lambda record: rise(record, "depth"),
    "depth_settling_s": lambda record: settling(record, "depth"),
    "depth_overshoot": lambda record: overshoot(record, "depth"),
    "heading_rise_s": lambda record: rise(record, "heading"),
    "heading_settling_s": lambda record: settling(record, "heading"),
    "heading_overshoot": lambda record: overshoot(record, "heading"),
}
"""The same for task ``hold`` alone, whose episodes are steps from the start to constant goals."""


def measure(record: Record, task: str) -> dict[str, FloatArray]:
    """Returns all metrics of a task, each (N,); NaN where one does not apply to an episode."""
    wanted = METRICS | (STEP_METRICS if task == STEP_RESPONSE_TASK else {})
    return {name: function(record) for name, function in wanted.items()}
