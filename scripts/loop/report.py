"""What came of it: as numbers for a file, and as Markdown for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robofish_agents.evaluation.intervals import Interval
from robofish_agents.evaluation.labels import LABELS
from scripts.loop.declaration import Declaration
from scripts.loop.gains import Scores, difference, over_seeds, per_fish, share_closed
from scripts.loop.measuring import Known
from scripts.loop.training import (
    ARMS,
    BASELINE,
    EXTENDED,
    PID,
    POSTERIOR,
    RANDOMISED,
    SHIPPED,
    TRUTH,
    Means,
    Score,
)

COMPARED = (
    (EXTENDED, BASELINE),
    (POSTERIOR, BASELINE),
    (TRUTH, BASELINE),
    (RANDOMISED, BASELINE),
    (EXTENDED, RANDOMISED),
    (POSTERIOR, EXTENDED),
    (TRUTH, EXTENDED),
)
CLOSING = (EXTENDED, POSTERIOR)
BESIDE = (PID, SHIPPED)
MEAN = "mean of these"
MORE_IS_BETTER = ("episode_return", "success_rate")


def scores_of(rows: Sequence[Score], task: str, metric: str) -> Scores:
    """Arm -> (fish, seeds), in the order in which they are in the rows."""
    fish = list(dict.fromkeys(row.fish for row in rows))
    seeds = sorted({row.seed for row in rows})
    found = {(row.arm, row.fish, row.seed): row.means[task][metric] for row in rows}
    return {
        arm: np.array([[found[arm, name, seed] for seed in seeds] for name in fish]) for arm in ARMS
    }


def summarise(declared: Declaration, rows: Sequence[Score]) -> list[dict[str, Any]]:
    """One entry for each task and metric: means of the arms, differences, shares closed."""
    entries = []
    for task in declared.tasks:
        for metric in declared.metrics:
            scores = scores_of(rows, task, metric)
            entry: dict[str, Any] = {"task": task, "metric": metric}
            entry["means"] = {arm: float(values.mean()) for arm, values in scores.items()}
            entry["differences"] = [_difference(scores, metric, *pair) for pair in COMPARED]
            entry["closed"] = {arm: _finite(share_closed(scores, arm)) for arm in CLOSING}
            entries.append(entry)
    return entries


def _difference(scores: Scores, metric: str, arm: str, reference: str) -> dict[str, Any]:
    sign = 1.0 if metric in MORE_IS_BETTER else -1.0
    better = int((sign * per_fish(scores, arm, reference) > 0.0).sum())
    interval = difference(scores, arm, reference)
    return {"arm": arm, "reference": reference, "fish_better": better, **interval._asdict()}


def _finite(interval: Interval) -> dict[str, float | None]:
    pairs = interval._asdict().items()
    return {key: float(value) if np.isfinite(value) else None for key, value in pairs}


def fish_entry(known: Known) -> dict[str, Any]:
    """What was hidden in a fish, and what its diagnosis found."""
    return {
        "name": known.name,
        "hidden": known.truth.effects,
        "extended": known.extended is not None,
        **known.about,
    }


def markdown(record: dict[str, Any], declared: Declaration, rows: Sequence[Score]) -> str:
    """The results as tables."""
    primary = scores_of(rows, declared.tasks[0], declared.metrics[0])
    label = LABELS[declared.metrics[0]][0]
    parts = [
        "### Hidden and found effects",
        _fish_table(record["fish"]),
        f"### Each fish: {label} on `{declared.tasks[0]}`",
        "Cells show the mean over the seeds, with the standard deviation in brackets. Differences "
        "have 95 % intervals over the seeds. 'No gap' means that the interval includes zero.",
        _each_fish(primary, _beside(record["beside"], declared.tasks[0], declared.metrics[0])),
        "### Means over fish and seeds",
        "The last columns show the PID controller and the policies shipped for "
        f"`{declared.tasks[0]}`, both made on the nominal fish and many fish around it.",
        _means_table(record["summary"], record["beside"]),
        "### Differences",
        "Intervals are 95 %, over the fish. Brackets show on how many fish it is better.",
        _differences_table(record["summary"], len(record["fish"])),
        "### Share of the gap between nominal fish and truth that is closed",
        "In per cent, with 95 % intervals over the fish. 'Open' means that the gap could be zero, "
        "so the share has little meaning.",
        _closed_table(record["summary"]),
    ]
    return "\n\n".join(parts)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    rule = ["---"] * left + ["--:"] * (len(head) - left)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *rows))


def _fish_table(fish: Sequence[dict[str, Any]]) -> str:
    rows = [[e["name"], _hidden(e), f"`{e['verdict']}`", _found(e)] for e in fish]
    return _table(("fish", "hidden", "verdict", "found, with 95 % intervals"), rows, left=4)


def _hidden(entry: dict[str, Any]) -> str:
    return "; ".join(
        f"{name} ({', '.join(f'{key} {value:.3g}' for key, value in values.items())})"
        for name, values in entry["hidden"].items()
    )


def _found(entry: dict[str, Any]) -> str:
    causes = "; ".join(
        f"{cause['name']} ({', '.join(_estimate(*item) for item in cause['parameters'].items())})"
        for cause in entry["causes"]
    )
    others = [" + ".join(cause["name"] for cause in other) for other in entry["alternatives"]]
    rivals = f"; or {', or '.join(others)}" if others else ""
    return f"{causes or 'nothing'}{rivals}{'' if entry['extended'] else '; no extended model'}"


def _estimate(name: str, found: dict[str, Any]) -> str:
    low, high = found["ci95"]
    return f"{name} {found['estimate']:.3g}, {low:.3g} to {high:.3g}"


def _beside(
    beside: Mapping[str, Mapping[str, Means]], task: str, metric: str
) -> dict[str, dict[str, float]]:
    """Fish -> who was not trained here -> one metric; the last row is the mean over the fish."""
    rows = {
        fish: {name: means[name][task][metric] for name in BESIDE} for fish, means in beside.items()
    }
    mean = {name: float(np.mean([row[name] for row in rows.values()])) for name in BESIDE}
    return {**rows, MEAN: mean}


def _each_fish(scores: Scores, beside: Mapping[str, Mapping[str, float]]) -> str:
    """A row for each fish, and one for the mean over them, seed by seed."""
    scores = {arm: np.vstack([v, v.mean(axis=0)]) for arm, v in scores.items()}
    compared = ("gap: truth - baseline", "gain: extended - baseline", "gain / gap (%)")
    head = ("fish", *ARMS, *BESIDE, *compared)
    rows = []
    for i, (name, others) in enumerate(beside.items()):
        cells = [f"{v[i].mean():.1f} ({v[i].std(ddof=1):.1f})" for v in scores.values()]
        cells += [f"{value:.1f}" for value in others.values()]
        gap = over_seeds(scores, TRUTH, BASELINE, i)
        gain = over_seeds(scores, EXTENDED, BASELINE, i)
        share = f"{100 * gain.mean / gap.mean:.0f}" if gap.low > 0.0 else "no gap"
        rows.append([name, *cells, _signed(gap), _signed(gain), share])
    return _table(head, rows)


def _signed(interval: Interval) -> str:
    return f"{interval.mean:+.1f} ({interval.low:+.1f} to {interval.high:+.1f})"


def _shown(metric: str, value: float, sign: str = "") -> str:
    value = LABELS[metric][1] * value
    return format(value, f"{sign}.{2 if abs(value) < 10 else 1}f")


def _means_table(
    summary: Sequence[dict[str, Any]], beside: Mapping[str, Mapping[str, Means]]
) -> str:
    rows = []
    for entry in summary:
        task, metric = entry["task"], entry["metric"]
        values = [entry["means"][arm] for arm in ARMS]
        values += _beside(beside, task, metric)[MEAN].values()
        cells = [_shown(metric, value) for value in values]
        rows.append([task, LABELS[metric][0], *cells])
    return _table(("task", "metric", *ARMS, *BESIDE), rows, left=2)


def _differences_table(summary: Sequence[dict[str, Any]], fish: int) -> str:
    head = ("task", "metric", *(f"{arm} - {reference}" for arm, reference in COMPARED))
    rows = []
    for entry in summary:
        metric = entry["metric"]
        cells = [
            f"{_shown(metric, d['mean'], '+')} ({_shown(metric, d['low'], '+')} to "
            f"{_shown(metric, d['high'], '+')}) [{d['fish_better']}/{fish}]"
            for d in entry["differences"]
        ]
        rows.append([entry["task"], LABELS[metric][0], *cells])
    return _table(head, rows, left=2)


def _closed_table(summary: Sequence[dict[str, Any]]) -> str:
    rows = [
        [e["task"], LABELS[e["metric"]][0], *(_closed(e["closed"][arm]) for arm in CLOSING)]
        for e in summary
    ]
    return _table(("task", "metric", *CLOSING), rows, left=2)


def _closed(share: dict[str, float | None]) -> str:
    mean, low, high = (share[key] for key in ("mean", "low", "high"))
    if mean is None:
        return "-"
    if low is None or high is None:
        return f"{100 * mean:.0f} (open)"
    return f"{100 * mean:.0f} ({100 * low:.0f} to {100 * high:.0f})"
