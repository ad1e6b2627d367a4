"""Rates of the realistic suite, and whether each of its criteria is met."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.hidden.realistic.plans import TIERS
from tests.hidden.realistic.scoring import RealRow
from tests.hidden.summary import middle, rate, rates_table, shown

MAIN_TIERS = tuple(name for name, tier in TIERS.items() if tier.budget)
NEAR = 0.10
"""Share of the misfit within which a budget is right."""


@dataclass(frozen=True)
class Criterion:
    """One thing that a suite must reach.

    Attributes:
        about: in words.
        tiers: whose cases count.
        value: a rate of :func:`rate`, a number, or None of nothing to judge.
        limit: what is to be reached.
        at_most: whether the value may not be above the limit; else it may not be below.
    """

    about: str
    tiers: tuple[str, ...]
    value: Callable[[Sequence[RealRow]], dict[str, float] | float | None]
    limit: float
    at_most: bool = False

    def judge(self, rows: Iterable[RealRow]) -> dict[str, Any]:
        """The value of a suite, and whether it is met; None where there is nothing to judge."""
        value = self.value([row for row in rows if row.tier in self.tiers])
        number = value["rate"] if isinstance(value, dict) else value
        met = None
        if number is not None:
            met = number <= self.limit if self.at_most else number >= self.limit
        way = "at most" if self.at_most else "at least"
        return {"about": self.about, "value": value, "limit": f"{way} {self.limit:g}", "met": met}


def main_named(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(bool(row.main_named) for row in rows)


def true_names(rows: Sequence[RealRow]) -> dict[str, float] | None:
    """Of all names that are claimed, those that are true."""
    wrong = sum(len(row.false_names) for row in rows)
    claimed = sum(len({*row.claimed, *row.false_names}) for row in rows)
    return rate([True] * (claimed - wrong) + [False] * wrong)


def without_false_name(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(not row.false_names and row.verdict != "error" for row in rows)


def with_false_name(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(bool(row.false_names) for row in rows)


def parameter_error(rows: Sequence[RealRow]) -> float | None:
    """Median over cases of the median relative error of the main effect's sizes."""
    return middle(float(np.median(list(row.errors.values()))) for row in rows if row.errors)


def budget_error(rows: Sequence[RealRow]) -> float | None:
    return middle(abs(row.budget_error) for row in rows if row.budget_error is not None)


def budget_near(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(abs(row.budget_error) <= NEAR for row in rows if row.budget_error is not None)


def told(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(bool(row.told) for row in rows)


def outside_right(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(bool(row.outside_right) for row in rows)


def nothing_named(rows: Sequence[RealRow]) -> dict[str, float] | None:
    return rate(not row.claimed and row.verdict != "error" for row in rows)


CRITERIA = (
    Criterion("main effect named, at full size", ("realistic",), main_named, 0.90),
    Criterion("main effect named, at 0.6 of its size", ("realistic_60",), main_named, 0.80),
    Criterion("names that are true, of all published", MAIN_TIERS, true_names, 0.97),
    Criterion("median error of the main effect's parameters", MAIN_TIERS, parameter_error, 0.10,
              True),
    Criterion("median error of the main effect's share in the budget", MAIN_TIERS, budget_error,
              NEAR, True),
    Criterion("no false name, small errors only", ("small_only",), without_false_name, 0.97),
    Criterion("suspect named or told by `inputs`", ("suspects",), told, 0.85),
    Criterion("false name beside a suspect", ("suspects",), with_false_name, 0.02, True),
    Criterion("foreign plant told as such", ("foreign_plant",), outside_right, 0.90),
    Criterion("nothing named in pure noise", ("noise_only",), nothing_named, 1.0),
)  # fmt: skip
"""What the suite must reach."""


def tier_summary(rows: Sequence[RealRow]) -> dict[str, Any]:
    """Rates and medians of one tier; what its cases do not ask is None."""
    covered = [flag for row in rows for flag in row.covered.values()]
    return {
        "cases": len(rows),
        "main_named": rate(row.main_named for row in rows if row.main_named is not None),
        "told": rate(row.told for row in rows if row.told is not None),
        "told_nameable": rate(row.told for row in rows if row.told is not None and row.nameable),
        "outside_right": rate(row.outside_right for row in rows if row.outside_right is not None),
        "true_names": true_names(rows),
        "without_false_name": without_false_name(rows),
        "nothing_named": nothing_named(rows),
        "refused": rate(row.verdict == "refused" for row in rows),
        "failed": rate(row.verdict == "error" for row in rows),
        "parameter_error": parameter_error(rows),
        "coverage": rate(covered),
        "budget_error": budget_error(rows),
        "budget_near": budget_near(rows),
        "median_gain_share": middle(row.gain_share for row in rows),
        "median_runtime_s": middle(row.runtime for row in rows),
    }


TITLES = {
    "cases": "cases",
    "main_named": "main effect named, or in the ambiguous set",
    "told": "suspect named or told",
    "told_nameable": "the same, of those that the catalogue has a name for",
    "outside_right": "told as outside the library, or in part with true names only",
    "true_names": "names that are true, of all published",
    "without_false_name": "no false name",
    "nothing_named": "nothing named",
    "refused": "data refused",
    "failed": "no answer",
    "parameter_error": "median relative error of the main effect's parameters",
    "coverage": "95 % intervals of the main effect that hold the truth",
    "budget_error": "median error of the main effect's share of the misfit",
    "budget_near": "shares within ten points of the truth",
    "median_gain_share": "median share of the reachable gap closed",
    "median_runtime_s": "median run time, s",
}


def answer(row: RealRow) -> str:
    """The verdict with all names that are claimed, false ones marked."""
    names = [f"**{n}**" if n in row.false_names else n for n in row.claimed]
    return f"{row.verdict}: {' + '.join(names)}" if names else row.verdict


def answers(rows: Sequence[RealRow]) -> dict[str, dict[str, int]]:
    """Answers by truth."""
    table: dict[str, Counter[str]] = {}
    for row in rows:
        table.setdefault(row.truth, Counter())[answer(row)] += 1
    return {truth: dict(counts.most_common()) for truth, counts in sorted(table.items())}


def summarise(rows: Sequence[RealRow]) -> dict[str, Any]:
    """Everything that the suite says: its criteria, its tiers, and every answer."""
    tiers = [tier for tier in TIERS if any(row.tier == tier for row in rows)]
    return {
        "cases": len(rows),
        "criteria": [criterion.judge(rows) for criterion in CRITERIA],
        "tiers": {tier: tier_summary([r for r in rows if r.tier == tier]) for tier in tiers},
        "answers": {tier: answers([r for r in rows if r.tier == tier]) for tier in tiers},
    }


def markdown(summary: dict[str, Any]) -> str:
    """The summary as a page: the criteria, then each tier with its rates and answers."""
    lines = ["## Criteria", "", "| | value | required | |", "| --- | --- | --- | --- |"]
    words = {True: "met", False: "not met", None: "not measured"}
    for one in summary["criteria"]:
        value = shown(one["value"])
        lines.append(f"| {one['about']} | {value} | {one['limit']} | {words[one['met']]} |")
    for tier, rates in summary["tiers"].items():
        lines += ["", f"## {tier}", "", TIERS[tier].about, "", *rates_table(rates, TITLES)]
        lines += ["", "False names are bold.", "", "| hidden | answers |", "| --- | --- |"]
        for truth, said in summary["answers"][tier].items():
            lines.append(f"| {truth} | {', '.join(f'{a} x {n}' for a, n in said.items())} |")
    return "\n".join(lines) + "\n"
