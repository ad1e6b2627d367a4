"""Tables of results: a row for each agent, a column for each suite."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fish_env.envs.tasks import SIGNAL_TASKS
from fish_env.errors import ConfigError
from robofish_agents.evaluation.goal_metrics import GOAL_METRICS
from robofish_agents.evaluation.labels import LABELS, mean_and_range
from robofish_agents.evaluation.results import Result
from robofish_agents.evaluation.suites import suite_names

SHIPPED = Path(__file__).with_name("leaderboard.json")
"""Results of the agents that come with the package, written by scripts/benchmark_agents.py."""
FAMILIES: tuple[tuple[str, ...], ...] = (SIGNAL_TASKS, ("path",), ("station",))
"""Tasks that share suites, and so a table."""
OF_SIGNALS = {
    "success_rate": "%",
    "depth_rmse_m": "cm",
    "heading_rmse_rad": "°",
    "mean_power_w": "mW",
}
SHOWN = {
    **dict.fromkeys(SIGNAL_TASKS, OF_SIGNALS),
    "path": {
        "success_rate": "%",
        "cross_track_rmse_m": "cm",
        "depth_rmse_m": "cm",
        "mean_power_w": "mW",
    },
    "station": {
        "success_rate": "%",
        "place_rmse_m": "cm",
        "place_late_rmse_m": "cm",
        "mean_power_w": "mW",
    },
}
"""Task -> metrics in each cell of the overview, with the units of their labels."""
OWN_METRICS = {name for metrics in GOAL_METRICS.values() for name in metrics}
MISSING = "not measured"


def overview(results: Sequence[Result]) -> str:
    """Returns the metrics of SHOWN on every suite as Markdown: a table for each family of tasks."""
    return _tables(results, _overview_cell)


def by_metric(results: Sequence[Result], metric: str) -> str:
    """Returns one metric with its 95 % intervals on every suite, as Markdown.

    Raises:
        ConfigError: no such metric.
    """
    if metric not in LABELS:
        raise ConfigError(f"metric '{metric}': one of {', '.join(LABELS)}")
    wanted = [r for r in results if r.task in SIGNAL_TASKS or metric in r.metrics]
    if metric in OWN_METRICS:
        wanted = [r for r in results if metric in r.metrics]
    return _tables(wanted, lambda result: _metric_cell(result, metric))


def _overview_cell(result: Result) -> str:
    parts = []
    for metric, unit in SHOWN[result.task].items():
        mean, _ = mean_and_range(metric, result.metrics[metric])
        short = mean.removesuffix(".0") if metric == "success_rate" else mean
        parts.append(f"{short}{'' if unit == '°' else ' '}{unit}")
    return ", ".join(parts)


def _metric_cell(result: Result, metric: str) -> str:
    mean, spread = mean_and_range(metric, result.metrics.get(metric))
    return f"{mean} ({spread})" if spread else mean


def _tables(results: Sequence[Result], cell: Callable[[Result], str]) -> str:
    families = [[r for r in results if r.task in family] for family in FAMILIES]
    return "\n\n".join(_table(family, cell) for family in families if family)


def _table(results: Sequence[Result], cell: Callable[[Result], str]) -> str:
    suites = [name for name in suite_names() if any(r.suite == name for r in results)]
    suites += sorted({r.suite for r in results} - set(suites))
    lines = [
        f"| task | agent | {' | '.join(suites)} |",
        f"| --- | --- |{' --- |' * len(suites)}",
    ]
    for task in dict.fromkeys(result.task for result in results):
        of_task = [result for result in results if result.task == task]
        for agent in sorted({r.agent for r in of_task}, key=lambda a: _rank(a, of_task)):
            own = {r.suite: r for r in of_task if r.agent == agent}
            cells = [cell(own[s]) if s in own else MISSING for s in suites]
            lines.append(f"| {task} | {_named(own)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _named(own: dict[str, Result]) -> str:
    result = next(iter(own.values()))
    return f"{result.agent}, {result.seeds} seeds" if result.seeds > 1 else result.agent


def _rank(agent: str, results: Sequence[Result]) -> tuple[float, str]:
    """Best mean return first."""
    returns = [m.mean for r in results if r.agent == agent if (m := r.metrics["episode_return"])]
    return -sum(returns) / max(len(returns), 1), agent
