"""Writes docs/benchmarks.md from the latest measurements.

Run it as ``python -m scripts.make_benchmarks_page``.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from scripts import agents_report
from tests.hidden.suite import SUITES, Suite

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"
SPEED = ROOT / "scripts" / "bench" / "results"
DIAGNOSIS = ROOT / "results"

HEAD = """\
# Benchmarks

`make docs` writes this page from the latest measurements. Each section says where and when it was
measured, and names the command that repeats it.
"""
SPEED_HEAD = """\
## Speed

`make bench` runs this simulator and other simulators in one process, in turn.
"""
GPU_HEAD = """\
## Speed on a GPU

`make bench-gpu` measures the environment on a GPU, the training on it, and a swimmer of MJX, in one
process. A control step of the environment includes goal, observation, reward and restarts; the
swimmer is bare physics. "Bare physics" of the fish copies its commands from the host. [On a
GPU](gpu.md) describes the environment.
"""
AGENTS_HEAD = """\
## Agents
"""
DIAGNOSIS_HEAD = """\
## Diagnosis

`make benchmark-diagnosis` simulates measurements with another implementation of the physics. It
hides one or more effects, wrong coefficients, or nothing in them, and counts the right and wrong
answers of [the diagnosis](diagnosis.md). Intervals are 95 % (Clopper-Pearson).
"""
REALISTIC_HEAD = """\
## Diagnosis of realistic robots

`make benchmark-realistic` hides what real robots have:

* one main effect, at three sizes, among five to ten small ones, with sensor errors and
  run-to-run variation;
* single faults of sensors, inputs and robot;
* physics of another kind;
* nothing but noise.

It is scored apart from the suite above. A named cause counts as true if it acts, however small it
is. Intervals are 95 % (Clopper-Pearson).
"""


def page(speed: Path = SPEED, diagnosis: Path = DIAGNOSIS) -> str:
    """The page as Markdown."""
    parts = [HEAD, SPEED_HEAD, _latest(speed, "speed"), GPU_HEAD, _latest(diagnosis, "gpu")]
    parts += [AGENTS_HEAD, agents_report.section()]
    parts += [DIAGNOSIS_HEAD, _latest(diagnosis, "diagnosis")]
    parts += [REALISTIC_HEAD, _latest(diagnosis, "realistic")]
    return "\n".join([*parts, ""]).rstrip() + "\n"


def _latest(folder: Path, name: str) -> str:
    """The reports of the latest run in a folder, one after another, headings one level lower.

    Parts of a hidden suite are summed up as one.
    """
    parts = _parts(folder, name)
    if not parts:
        return "No full run is published yet.\n"
    suite = next((suite for suite in SUITES.values() if suite.result == name), None)
    if suite is not None and len(parts) > 1:
        return lowered(_summed(parts, suite))
    return "\n".join(lowered(file.read_text(encoding="utf-8")) for file in parts)


def _parts(folder: Path, name: str) -> list[Path]:
    """The reports of the latest run in a folder, in the order in which they were made.

    The first of a run is named by its date alone; later parts have a number too, and some may be of
    later days.
    """
    dated = {file: _dated(file, name) for file in folder.glob(f"{name}-[0-9]*.md")}
    begun = max((date for date, number in dated.values() if number == 0), default="")
    latest = [file for file, (date, _) in dated.items() if date >= begun]
    return sorted(latest, key=lambda file: dated[file])


def _dated(file: Path, name: str) -> tuple[str, int]:
    """Date of a part, and its number; none is zero."""
    *date, number = [*file.stem.removeprefix(f"{name}-").split("-"), "0"][:4]
    return "-".join(date), int(number)


def _summed(parts: list[Path], suite: Suite) -> str:
    """One report of all cases of some parts, each case as its own commit answered it."""
    found = [json.loads(p.with_suffix(".json").read_text(encoding="utf-8")) for p in parts]
    rows = [suite.row_of({"row": row}) for part in found for row in part["rows"]]
    rows.sort(key=lambda row: (row.tier, row.seed))
    commits = ", ".join(f"{len(part['rows'])} at {part['commit']}" for part in found)
    said = f"{len(rows)} cases, each diagnosed once: {commits}."
    date = " to ".join(sorted({found[0]["date"], found[-1]["date"]}))
    return suite.page(date, said, suite.summarise(rows))


def lowered(text: str) -> str:
    """Markdown with every heading two levels lower, and blank lines before lists."""
    lines = re.sub(r"^(#+ )", r"##\1", text.strip(), flags=re.MULTILINE).splitlines()
    spaced: list[str] = []
    for line in lines:
        begins_list = line.startswith("- ") and spaced and spaced[-1] and spaced[-1][0] != "-"
        spaced += [""] * bool(begins_list) + [line]
    return "\n".join(spaced) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")
