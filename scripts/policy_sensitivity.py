"""Shows which numbers set by hand answers depend on: all are changed at once, then divided.

    python -m scripts.policy_sensitivity --designs 8   # goes on where it was stopped
    python -m scripts.policy_sensitivity --sum         # writes results/policy-sensitivity-<date>

In each design every number set by hand is multiplied or divided by a factor, by the toss of a coin,
and hidden cases are diagnosed. Where no answer changes, none of the numbers mattered there (group
screening: Watson, "A study of the group screening method", Technometrics 3, 1961). Where one does,
`--numbers` repeats that design with some of the numbers.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from fish_env.diagnosis.policy import POLICIES  # noqa: E402
from fish_env.inference.policy_numbers import BY_HAND, EFFORT, Numbers  # noqa: E402
from scripts.results import RESULTS, kept, write_dated  # noqa: E402

CASES = ("rich-20000", "small-20000", "camera-20000", "null-20000", "pairs-20000", "outside-20000")
FACTOR = 1.25
USUAL = "usual"
"""The design that changes nothing."""


def by_hand() -> Iterator[tuple[str, Numbers, str]]:
    """Policy, its numbers and name of each that was set by hand and does not limit effort."""
    for policy, numbers in POLICIES.items():
        for item in fields(numbers):
            source = item.metadata["source"]
            if BY_HAND in source and EFFORT not in source:
                yield policy, numbers, item.name


def changed(value: float, low: float, high: float, up: bool, factor: float = FACTOR) -> float:
    """A number times or divided by a factor; a whole one by at least 1, a share towards 0 or 1.

    Args:
        value: the number.
        low: smallest value allowed.
        high: largest value allowed.
        up: whether it grows.
        factor: above 1.
    """
    if high == 1.0 and value > 0.5:
        return max(low, 1.0 - (1.0 - value) * (1.0 / factor if up else factor))
    new = value * (factor if up else 1.0 / factor)
    if isinstance(value, int):
        new = max(round(new), value + 1) if up else min(round(new), value - 1)
    return min(max(new, low), high)


def design(number: str) -> dict[str, bool]:
    """Which numbers grow in a design, by "policy.name"."""
    names = [f"{policy}.{name}" for policy, _, name in by_hand()]
    toss = random.Random(number)
    return {name: toss.random() < 0.5 for name in names}


def change(number: str, only: Sequence[str]) -> None:
    """Changes the numbers of this process; they are frozen for everybody else."""
    if number == USUAL:
        return
    grows = design(number)
    for policy, numbers, name in by_hand():
        if not only or f"{policy}.{name}" in only:
            limits = next(i.metadata for i in fields(numbers) if i.name == name)
            value = getattr(numbers, name)
            up = grows[f"{policy}.{name}"]
            new = changed(value, limits["low"], limits["high"], up)
            object.__setattr__(numbers, name, new)


def answer(case: str, number: str, only: Sequence[str]) -> dict[str, Any]:
    """What a diagnosis says of a case under a design."""
    change(number, only)
    from tests.hidden.suite import PIPELINE, Job, make  # modules may copy numbers

    tier, seed = case.rsplit("-", 1)
    row = make(Job(tier, int(seed), "", PIPELINE, False))["row"]
    return {key: row[key] for key in ("verdict", "named", "alternatives", "error")}


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(prog="python -m scripts.policy_sensitivity")
    add = parser.add_argument
    add("--designs", type=int, default=8, help="number of designs (8)")
    add("--cases", nargs="+", default=CASES, help="TIER-SEED of the hidden suite")
    add("--numbers", nargs="+", default=(), help="change these alone, POLICY.NAME")
    add("--work", type=Path, default=ROOT / "out" / "policy-sensitivity", help="finished answers")
    add("--sum", action="store_true", help="write the dated result")
    add("--one", nargs=2, metavar=("CASE", "DESIGN"), help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Diagnose each case under each design, in processes of their own."""
    options = parse(arguments)
    if options.one:
        case, number = options.one
        name = f"{case}-{number}" + ("".join(f"+{n}" for n in options.numbers))
        kept(options.work / f"{name}.json", partial(answer, case, number, options.numbers))
        return
    designs = [USUAL, *map(str, range(options.designs))]
    options.work.mkdir(parents=True, exist_ok=True)
    if not options.sum:
        given = ["--numbers", *options.numbers] if options.numbers else []
        for number in designs:
            for case in options.cases:
                own = ["--one", case, number, "--work", str(options.work), *given]
                script = [sys.executable, "-m", "scripts.policy_sensitivity"]
                subprocess.run([*script, *own], check=True)
    print(summed(options, designs))


def summed(options: argparse.Namespace, designs: Sequence[str]) -> str:
    """The table of answers; with ``--sum`` it is written."""
    found: dict[str, dict[str, Any]] = {}
    for case in options.cases:
        for number in designs:
            file = options.work / f"{case}-{number}.json"
            if file.exists():
                found.setdefault(case, {})[number] = kept(file, dict)
    lines = [
        "| case | answer | designs with the same verdict and names | others |",
        "| --- | --- | --- | --- |",
    ]
    for case, answers in found.items():
        told = {number: said(a) for number, a in answers.items()}
        usual = told.pop(USUAL, "")
        others = {number: text for number, text in told.items() if text != usual}
        same = len(told) - len(others)
        beside = "; ".join(f"{n}: {text}" for n, text in others.items())
        lines.append(f"| {case} | {usual} | {same} of {len(told)} | {beside} |")
    page = "\n".join(lines) + "\n"
    if options.sum:
        grows = {number: design(number) for number in designs if number != USUAL}
        content = {"factor": FACTOR, "answers": found, "designs": grows}
        write_dated(RESULTS, "policy-sensitivity", content, page)
    return page


def said(found: dict[str, Any]) -> str:
    """Verdict and names, as a table has them."""
    return f"{found['verdict']} {', '.join(found['named'])}".strip()


if __name__ == "__main__":
    main()
