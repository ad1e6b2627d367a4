"""Rates with intervals and the confusion matrix of a suite of scored cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tests.hidden.plans import DESIGNS
from tests.hidden.scoring import Row

TIERS = {
    "rich": "One effect of typical size in eight runs of 30 s: nine channels at 25 Hz, sensor "
    "noise, a small coloured disturbance.",
    "small": "The same at 0.3 of the size.",
    "camera": "As rich, but x, y, z and yaw only, at 15 Hz, with unknown starts and tail phases.",
    "closed_loop": "As rich, but the commands come from a controller.",
    "pairs": "Two effects at once.",
    "triples": "Three effects at once.",
    "outside": "An effect that the library does not have.",
    "designs": f"As rich, but other experiments: {'; '.join(DESIGNS)}.",
    "coefficients": "One to three coefficients off by three to six prior deviations.",
    "null": "Nothing wrong, runs as in rich.",
    "null_strong": "Nothing wrong, disturbances of 5 to 10 mN over 1 to 5 s, with four spectra.",
    "null_camera": "Nothing wrong, seen by a camera.",
    "null_closed_loop": "Nothing wrong, under a controller.",
    "null_designs": "Nothing wrong, experiments as in designs.",
    "poor": "Runs that cannot show what is wrong.",
    "steady": "Tables of steady motion instead of runs.",
}
"""What each tier holds, in the order in which they are told."""
RATES: tuple[tuple[str, str, Callable[[Row], bool]], ...] = (
    ("verdict_right", "verdict right", lambda row: row.verdict_right),
    ("name_right", "verdict and name right", lambda row: row.name_right),
    ("set_right", "ambiguous, truth in the set", lambda row: row.set_right),
    ("partial", "partly right", lambda row: row.partial),
    ("wrong_single", "wrong single name", lambda row: row.wrong_single),
    ("failed", "no answer", lambda row: row.verdict == "error"),
)


def rate(flags: Iterable[bool]) -> dict[str, float] | None:
    """A share with its 95 % Clopper-Pearson interval; None of nothing."""
    values = list(flags)
    if not values:
        return None
    test = binomtest(sum(values), len(values))
    interval = test.proportion_ci(0.95, "exact")
    return {
        "count": sum(values),
        "of": len(values),
        "rate": float(test.statistic),
        "low": float(interval.low),
        "high": float(interval.high),
    }


def middle(values: Iterable[float | None]) -> float | None:
    """The median of what is known."""
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def tier_summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Rates and medians of one tier."""
    detectable = [row for row in rows if row.above_detectable and row.above_detectable >= 1]
    covered = [flag for row in rows for flag in row.covered.values()]
    return {
        "cases": len(rows),
        **{key: rate(map(test, rows)) for key, _, test in RATES},
        "false_alarm": rate(row.false_alarm for row in rows if row.truth == "nothing"),
        "name_right_above_detectable": rate(row.name_right for row in detectable),
        "coverage": rate(covered),
        "coefficient_coverage": rate(
            flag
            for row in rows
            for flag in [True] * row.coefficients_covered
            + [False] * (row.coefficients - row.coefficients_covered)
        ),
        "median_parameter_error": middle(e for row in rows for e in row.errors.values()),
        "median_gain_share": middle(row.gain_share for row in rows),
        "median_runtime_s": middle(row.runtime for row in rows),
    }


def answer(row: Row) -> str:
    """Column of the confusion matrix: the verdict, and for a wrong naming the names."""
    if row.verdict in ("cause", "parameters") and not row.name_right:
        return f"{row.verdict}: {' + '.join(row.named) or 'none'}"
    return row.verdict + (" (right)" if row.name_right else "")


def confusion(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """Answers by truth."""
    table: dict[str, Counter[str]] = {}
    for row in rows:
        table.setdefault(row.truth, Counter())[answer(row)] += 1
    return {truth: dict(counts.most_common()) for truth, counts in sorted(table.items())}


def summarise(rows: Sequence[Row]) -> dict[str, Any]:
    """Everything that a suite says: by tier, over all, and the confusion matrix."""
    tiers = [tier for tier in TIERS if any(row.tier == tier for row in rows)]
    return {
        "cases": len(rows),
        "overall": tier_summary(rows),
        "tiers": {tier: tier_summary([r for r in rows if r.tier == tier]) for tier in tiers},
        "confusion": {tier: confusion([r for r in rows if r.tier == tier]) for tier in tiers},
    }


def shown(value: Any) -> str:
    """A rate as "97 % (83-100)", a number to three digits, a dash for nothing."""
    if value is None:
        return "-"
    if isinstance(value, dict):
        low, high = 100 * value["low"], 100 * value["high"]
        return f"{100 * value['rate']:.0f} % ({low:.0f}-{high:.0f}), {value['count']}/{value['of']}"
    return f"{value:.3g}"


TITLES = {
    "cases": "cases",
    **{key: title for key, title, _ in RATES},
    "false_alarm": "false alarm where nothing is wrong",
    "name_right_above_detectable": "right name, above the smallest detectable size",
    "coverage": "95 % intervals of effects that hold the truth",
    "coefficient_coverage": "95 % intervals of coefficients that hold the truth",
    "median_parameter_error": "median relative parameter error",
    "median_gain_share": "median share of the reachable gap closed",
    "median_runtime_s": "median run time, s",
}


def markdown(summary: dict[str, Any]) -> str:
    """The summary as a page: all cases, then each tier with its rates and confusion matrix."""
    lines = ["## All cases", "", *rates_table(summary["overall"], TITLES)]
    for tier, rates in summary["tiers"].items():
        lines += ["", f"## {tier}", "", TIERS[tier], "", *rates_table(rates, TITLES)]
        lines += ["", "| hidden | answers |", "| --- | --- |"]
        for truth, answers in summary["confusion"][tier].items():
            said = ", ".join(f"{name} x {count}" for name, count in answers.items())
            lines.append(f"| {truth} | {said} |")
    return "\n".join(lines) + "\n"


def rates_table(rates: dict[str, Any], titles: dict[str, str]) -> list[str]:
    """Two columns: what is counted, and the rate with its interval; nothing that has no cases."""
    known = [(title, rates[key]) for key, title in titles.items() if rates[key] is not None]
    return ["| | |", "| --- | --- |", *(f"| {title} | {shown(value)} |" for title, value in known)]
