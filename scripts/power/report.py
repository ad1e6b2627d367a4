"""Power curves, and published sizes beside what is allowed: numbers, a page and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from fish_env.plotting.style import BLACK, BLUE, DOTS_PER_INCH, VERMILION, drawing
from scripts.power.curves import Curve, fit_curve, strength
from scripts.power.limits import noncentrality
from scripts.results import today, write_dated
from tests.hidden.sizes import ABSORBED
from tests.hidden.summary import rate

Rows = Sequence[dict[str, Any]]


def write(summary: dict[str, Any], folder: Path) -> None:
    """Writes `power-<date>.json` and `.md`."""
    page = f"# Power of the screen, {today()}\n\n{markdown(summary)}"
    write_dated(folder, "power", summary, page)
    print(page)


def summarise(rows: Rows, nothing: Rows, signals: dict[str, Any]) -> dict[str, Any]:
    """All that the page says."""
    looks = [row for row in rows if "statistic" in row]
    noises = list(dict.fromkeys(row["noise"] for row in looks))
    return {
        "data_sets": len(rows) + len(nothing),
        "cpu_s": float(sum(row["cpu_s"] for row in [*rows, *nothing])),
        "noises": {noise: by_target([r for r in looks if r["noise"] == noise]) for noise in noises},
        "whole": [row for row in rows if "verdict" in row],
        "catalogue": catalogue([row for row in nothing if row["noise"] == "nominal"]),
        "signals": signals,
    }


def by_target(looks: Rows) -> dict[str, Any]:
    """Curves of each effect, and of all together."""
    targets = list(dict.fromkeys(row["target"] for row in looks))
    groups = {name: [row for row in looks if row["target"] == name] for name in targets}
    return {name: curves(group) for name, group in {**groups, "all": looks}.items()}


def curves(looks: Rows) -> dict[str, Any]:
    """Counts by size, the curve through them, and how strong the signals were."""
    sizes = [row["multiple"] for row in looks]
    result = {
        "counts": {
            f"{size:g}": rate(row["found"] for row in looks if row["multiple"] == size)
            for size in sorted(set(sizes))
        },
        "found": asdict(fit_curve(sizes, [row["found"] for row in looks])),
        "misfit": asdict(fit_curve(sizes, [row["misfit"] for row in looks])),
    }
    expected = [promised(row) * row["multiple"] ** 2 for row in looks]
    over = [row["statistic"] - row["freedom"] for row in looks]
    return {**result, "strength": strength(over, expected, [row["freedom"] for row in looks])}


def promised(row: dict[str, Any]) -> float:
    """Noncentrality at the published size."""
    return noncentrality(float(chi2.sf(row["bound"], row["freedom"])), row["freedom"])


def catalogue(nothing: Rows) -> dict[str, dict[str, float]]:
    """Medians over designs: published over allowed, and what proportion would have published."""
    found: dict[str, dict[str, float]] = {}
    for name in nothing[0]["published"] if nothing else ():
        rows = [row for row in nothing if name in row["published"]]
        found[name] = {
            "in_proportion": middle(row["in_proportion"][name] / row["published"][name]
                                    for row in rows)
        }  # fmt: skip
        absorbed = name.split(".")[0] in ABSORBED
        for kind in () if absorbed else ("same", "alone", "known"):
            allowed = [row for row in rows if name in row["limits"]]
            if allowed:
                found[name][kind] = middle(
                    row["published"][name] / row["limits"][name][kind] for row in allowed
                )
    return found


def middle(values: Any) -> float:
    return float(np.median(list(values)))


def between(curve: dict[str, Any]) -> str:
    low = f"{curve['low']:.2f}" if curve["low"] > 0.201 else "below 0.2"
    return f"{curve['at']:.2f} ({low}-{curve['high']:.2f})"


def markdown(summary: dict[str, Any]) -> str:
    """The page."""
    lines = [
        f"{summary['data_sets']} data sets, {summary['cpu_s'] / 60:.0f} minutes of processor time.",
    ]
    for noise, targets in summary["noises"].items():
        lines += ["", f"## {noise.capitalize()} noise", "", *power_table(targets)]
    lines += ["", "## Whole diagnoses", "", *whole_table(summary["whole"])]
    lines += ["", "## Published over allowed", "", *catalogue_table(summary["catalogue"])]
    lines += ["", "## Signals, expected and made", "", *signals_table(summary["signals"])]
    return "\n".join(lines) + "\n"


def power_table(targets: dict[str, Any]) -> list[str]:
    sizes = list(next(iter(targets.values()))["counts"])
    lines = [
        f"| effect | {' | '.join(f'found at {size}' for size in sizes)} | size with power 0.8 "
        "| any misfit | strength of the signal |",
        f"| --- {'| ---: ' * len(sizes)}| ---: | ---: | ---: |",
    ]
    for name, one in targets.items():
        counts = [counted(one["counts"].get(size)) for size in sizes]
        of = one["strength"]
        lines.append(
            f"| {name} | {' | '.join(counts)} | {between(one['found'])} | {between(one['misfit'])} "
            f"| {of['ratio']:.2f} ({of['low']:.2f}-{of['high']:.2f}) |"
        )
    return lines


def counted(count: dict[str, Any] | None) -> str:
    return f"{count['count']}/{count['of']}" if count else "-"


def whole_table(rows: Rows) -> list[str]:
    lines = ["| effect | size | verdict | named |", "| --- | ---: | --- | --- |"]
    return lines + [
        f"| {row['target']} | {row['multiple']:g} | {row['verdict']} "
        f"| {', '.join(row['named']) or '-'} |"
        for row in rows
    ]


def catalogue_table(found: dict[str, dict[str, float]]) -> list[str]:
    lines = [
        "| parameter | same level | test at 5 % | coefficients known | proportion / published |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for name, one in sorted(found.items(), key=lambda item: -item[1].get("same", 0.0)):
        cells = [f"{one[k]:.2f}" if k in one else "-" for k in ("same", "alone", "known")]
        lines.append(f"| {name} | {' | '.join(cells)} | {one['in_proportion']:.2f} |")
    return lines


def signals_table(signals: dict[str, Any]) -> list[str]:
    lines = ["| parameter | cosine | share |", "| --- | ---: | ---: |"]
    ordered = sorted(signals.items(), key=lambda item: item[1]["cosine"])
    return lines + [
        f"| {name} | {one['cosine']:.2f} | {one['share']:.2f} |" for name, one in ordered
    ]


def draw(summary: dict[str, Any], file: Path) -> None:
    """Power curves under each noise, and the catalogue's distance from what is allowed."""
    noises = summary["noises"]
    with drawing(7.2, 5.2) as figure:
        left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.15))
        panels = left.subplots(len(noises), 1, sharex=True, squeeze=False)[:, 0]
        for panel, (noise, targets) in zip(panels, noises.items(), strict=True):
            _power(panel, noise, targets)
        panels[-1].set_xlabel("size / published smallest detectable size")
        _catalogue(right.subplots(), summary["catalogue"])
        file.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(file, dpi=DOTS_PER_INCH)


def _power(panel: Any, noise: str, targets: dict[str, Any]) -> None:
    sizes = np.linspace(0.5, 1.6, 200)
    for name, one in targets.items():
        if name != "all":
            panel.plot(sizes, _curve(one).share(sizes), color=BLUE, alpha=0.3, linewidth=1.0)
    together = targets["all"]
    panel.plot(sizes, _curve(together).share(sizes), color=BLACK)
    for size, count in together["counts"].items():
        low, high = count["rate"] - count["low"], count["high"] - count["rate"]
        panel.errorbar(float(size), count["rate"], [[low], [high]], fmt="o", color=BLACK, ms=4)
    panel.axvline(1.0, color=VERMILION, linewidth=0.9)
    panel.axhline(0.8, color=VERMILION, linewidth=0.9)
    panel.set(ylim=(-0.03, 1.03), ylabel="share found", title=f"{noise} noise")


def _curve(one: dict[str, Any]) -> Curve:
    return Curve(**one["found"])


def _catalogue(panel: Any, found: dict[str, dict[str, float]]) -> None:
    known = {name: one for name, one in found.items() if "same" in one}
    names = sorted(known, key=lambda name: known[name]["same"])
    rows = np.arange(len(names))
    for kind, colour, label in (
        ("same", BLUE, "at the screen's level"),
        ("alone", VERMILION, "one test at 5 %"),
    ):
        ratios = [known[name][kind] for name in names]
        panel.plot(ratios, rows, "o", color=colour, ms=3.5, label=label)
    panel.axvline(1.5, color=BLACK, linewidth=0.9)
    panel.set_yticks(rows, names, fontsize=5.5)
    panel.set(ylim=(-1, len(names)), xlim=(0.7, None), xlabel="published / allowed by information")
    panel.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=2, fontsize=7.0)
