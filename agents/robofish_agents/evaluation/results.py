"""Results of evaluations: made, written as JSON, read back."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from fish_env.files import write_text
from fish_env.reading import Unreadable, read_json, short
from fish_env.version import versioned
from robofish_agents.evaluation.goal_metrics import measure_task
from robofish_agents.evaluation.intervals import Interval, bootstrap, rate
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import Suite
from robofish_agents.registry import Agent

RATES = ("success_rate", "failure_rate")
MOST_BYTES = 20_000_000


@dataclass(frozen=True)
class Result:
    """One agent on one suite and task.

    Attributes:
        agent: name, as given to `robofish evaluate`.
        suite: name.
        suite_version: version of the suite.
        task: ``hold``, ``track``, ``path`` or ``station``.
        environment: id of the environment.
        seeds: number of training seeds; 1 for agents without training.
        episodes: number of episodes for each seed.
        metrics: metric -> mean and 95 % interval; None where it applies to no episode.
    """

    agent: str
    suite: str
    suite_version: int
    task: str
    environment: str
    seeds: int
    episodes: int
    metrics: dict[str, Interval | None]


def evaluate(
    name: str,
    agents: Sequence[Agent],
    suite: Suite,
    task: str,
    count: int | None = None,
    threads: int | None = None,
    report: Callable[[], object] = lambda: None,
) -> Result:
    """Measures an agent on a suite.

    Args:
        name: name of the agent in the result.
        agents: one, or one for each training seed.
        suite: which episodes.
        task: one of the suite's.
        count: number of episodes, from the first; default: all.
        threads: threads of the environment.
        report: called after each control step.

    Raises:
        ConfigError: the episodes of the suite have changed since it was frozen.
    """
    suite.check(task)
    measured = [
        measure_task(swim_suite(suite, task, agent, count, threads, report), task)
        for agent in agents
    ]
    metrics = {
        key: _interval(key, np.stack([values[key] for values in measured])) for key in measured[0]
    }
    return Result(
        name,
        suite.name,
        suite.version,
        task,
        ENV_ID,
        len(agents),
        count or suite.episodes,
        metrics,
    )


def _interval(key: str, values: np.ndarray) -> Interval | None:
    interval = rate(values) if key in RATES else bootstrap(values)
    return None if np.isnan(interval.mean) else interval


def write_results(path: Path, results: Sequence[Result], **more: Any) -> None:
    """Writes results, and whatever else describes them, as JSON."""
    rows = [_as_json(result) for result in results]
    write_text(path, json.dumps(versioned({**more, "results": rows}), indent=1) + "\n")


def _as_json(result: Result) -> dict[str, Any]:
    metrics = {
        key: None if interval is None else {k: _rounded(v) for k, v in interval._asdict().items()}
        for key, interval in result.metrics.items()
    }
    return {**asdict(result), "metrics": metrics}


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def read_results(path: Path) -> list[Result]:
    """Reads what :func:`write_results` wrote.

    Raises:
        ConfigError: no such file, or not results.
    """
    try:
        rows = read_json(path, MOST_BYTES)["results"]
        return [_from_json(row) for row in rows]
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; `robofish evaluate --json` makes one") from None
    except Unreadable as error:
        raise ConfigError(f"{path}: no results of `robofish evaluate`: {error}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        reason = short(repr(error), 120)
        raise ConfigError(f"{path}: no results of `robofish evaluate`: {reason}") from error


def _from_json(row: dict[str, Any]) -> Result:
    metrics = {
        key: None if value is None else Interval(**value) for key, value in row["metrics"].items()
    }
    return Result(**{**row, "metrics": metrics})
