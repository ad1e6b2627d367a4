"""From measurement to policy: is a policy that learns on the diagnosed model better on the fish?

Fish with undisclosed effects are measured and diagnosed; policies are trained on the printed fish,
on fish around it, on the extended model that the diagnosis wrote, on draws from its posterior and,
for comparison, on the hidden fish itself; all are judged on the hidden fish. What is compared was
declared beforehand in scripts/loop/measure-to-policy.yaml; docs/measure-to-policy.md says what came
of it.

    python -m scripts.measure_to_policy

Whatever is finished is kept, so a stopped run goes on where it was.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from scripts.bench.harness import machine, versions
from scripts.loop.declaration import DECLARED, Declaration, load_declaration
from scripts.loop.measuring import Known, measure_and_diagnose
from scripts.loop.report import fish_entry, markdown, summarise
from scripts.loop.training import ARMS, Score, judge_beside, scored
from scripts.results import today, write_dated
from scripts.update_readme import updated
from tests.hidden.suite import PIPELINE

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "measure-to-policy.md"
NAME = "measure-to-policy"
RESULT = f"{NAME}-from-teacher"
"""The results under the bare name are of a first recipe, whose policies began from nothing."""


def main(arguments: Sequence[str] | None = None) -> None:
    options, console = parse(arguments), Console(soft_wrap=True, highlight=False)
    declared = load_declaration(options.declared)
    known = diagnosed(declared, options.work, options.diagnose, console)
    if options.only_diagnose:
        return
    rows = trained(declared, known, options.work, console)
    write(declared, known, rows, options.out)
    if options.declared == DECLARED and options.out == ROOT / "results":
        write_page()


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    add = parser.add_argument
    add("--declared", type=Path, default=DECLARED, help="what to compare")
    add("--only-diagnose", action="store_true", help="measure and diagnose, and stop there")
    add("--diagnose", default=PIPELINE, help="module:function to diagnose with instead")
    add("--work", type=Path, default=ROOT / "out" / NAME)
    add("--out", type=Path, default=ROOT / "results", help="folder of the dated result")
    return parser.parse_args(arguments)


def diagnosed(declared: Declaration, work: Path, diagnose: str, console: Console) -> list[Known]:
    """All fish measured and diagnosed, one after the other, before anything is trained."""
    found = []
    for hidden in declared.fish:
        known = measure_and_diagnose(declared, hidden, work / "fish" / hidden.name, diagnose)
        names = ", ".join(cause["name"] for cause in known.about["causes"])
        console.print(f"{hidden.name}: {known.about['verdict']} {names}")
        found.append(known)
    return found


def trained(
    declared: Declaration, known: Sequence[Known], work: Path, console: Console
) -> list[Score]:
    """All policies trained and judged; every fish gets its first seed before any its second."""
    rows = []
    for seed in declared.seeds:
        for fish in known:
            for arm in ARMS:
                row = scored(declared, fish, arm, seed, work)
                value = row.means[declared.tasks[0]][declared.metrics[0]]
                console.print(
                    f"{fish.name}, {arm}, seed {seed}: {declared.metrics[0]} {value:.4g} "
                    f"({row.cpu_s:.0f} s of processor)"
                )
                rows.append(row)
    return rows


def record_of(
    declared: Declaration, known: Sequence[Known], rows: Sequence[Score]
) -> dict[str, Any]:
    """All that the results file holds."""
    return {
        "machine": machine(),
        "versions": versions(("stable-baselines3", "torch", "gymnasium", "numpy", "numba")),
        "cpu_s": {
            "diagnoses": sum(fish.about["cpu_s"] for fish in known),
            "trainings": sum(row.cpu_s for row in rows),
        },
        "fish": [fish_entry(fish) for fish in known],
        "suite": {"name": declared.suite.name, "episodes": declared.suite.episodes},
        "recipe": declared.recipe.tree(),
        "summary": summarise(declared, rows),
        "beside": {fish.name: judge_beside(declared, fish) for fish in known},
        "scores": [asdict(row) for row in rows],
    }


def write(
    declared: Declaration, known: Sequence[Known], rows: Sequence[Score], folder: Path
) -> Path:
    """Writes the dated result, as numbers and as a page."""
    record = record_of(declared, known, rows)
    text = f"# From measurement to policy, {today()}\n\n{markdown(record, declared, rows)}\n"
    return write_dated(folder, RESULT, record, text)


def latest(folder: Path = ROOT / "results") -> str:
    """The tables of the latest result."""
    *_, newest = sorted(folder.glob(f"{RESULT}-[0-9]*.md"))
    return newest.read_text(encoding="utf-8").partition("\n")[2].strip()


def write_page() -> None:
    """Puts the latest tables into the page."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(updated(text, {"results": latest}), encoding="utf-8")


if __name__ == "__main__":
    main()
