"""What the README and the benchmarks page say about the agents."""

from __future__ import annotations

import json
from pathlib import Path

from robofish_agents.evaluation.labels import LABELS
from robofish_agents.evaluation.leaderboard import SHIPPED, by_metric, overview
from robofish_agents.evaluation.results import read_results

ROOT = Path(__file__).resolve().parents[1]
NOT_YET = "No agent is measured yet; `make benchmark-agents` does it."
LEGEND = (
    "Each cell has success, RMSE of depth, RMSE of heading, and mean power of the tail: means over "
    "100 frozen episodes. RMSE are over whole episodes. For `path` they are those of cross-track "
    "error and of depth. For `station` both are of the distance from the place: over the whole "
    "episode, and over its last 10 s"
)


def headline(file: Path = SHIPPED) -> str:
    """The overview, for the README."""
    if not file.is_file():
        return NOT_YET
    return f"{overview(read_results(file))}\n\n{LEGEND} ([definitions](docs/evaluation.md))."


def section(file: Path = SHIPPED) -> str:
    """Every metric with its intervals, for the benchmarks page."""
    if not file.is_file():
        return f"{NOT_YET}\n"
    record = json.loads(file.read_text(encoding="utf-8"))
    results = read_results(file)
    parts = [
        f"Measured {record['date']}. {LEGEND} ([definitions](evaluation.md#metrics)).",
        overview(results),
        "### Time of a decision",
        f"For one fish, on {record['machine']['cores']} cores of {record['machine']['cpu']} that "
        "other work shared: wall-clock time and processor time. At 10 Hz, 100 ms are available.",
        _times(record["decision_times"]),
    ]
    for metric, (label, _) in LABELS.items():
        if any(result.metrics.get(metric) for result in results):
            parts += [f"### {label[0].upper()}{label[1:]}", by_metric(results, metric)]
    return "\n\n".join(parts) + "\n"


def _times(times: dict[str, dict[str, float]]) -> str:
    columns = ("wall_ms_median", "wall_ms_p99", "process_ms_median", "process_ms_p99")
    lines = [
        "| agent | clock, median (ms) | clock, 99 % (ms) | processor, median (ms) "
        "| processor, 99 % (ms) |",
        "| --- | --: | --: | --: | --: |",
    ]
    rows = ((agent, [f"{row[c]:.3g}" for c in columns]) for agent, row in times.items())
    return "\n".join([*lines, *(f"| {agent} | {' | '.join(cells)} |" for agent, cells in rows)])
