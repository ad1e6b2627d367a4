"""Writes the generated parts of README.md: `python -m scripts.update_readme`.

They stand between the comments `<!-- NAME -->` and `<!-- end of NAME -->`: the headlines of the
latest measurements of speed, agents and diagnosis, and how many of the paper's statements are held.
The tables themselves are on docs/benchmarks.md and docs/paper-statements.md.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from scripts import agents_report
from scripts.bench.report import short

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
RESULTS = ROOT / "scripts" / "bench" / "results"
DIAGNOSIS = ROOT / "results"
STATEMENTS = ROOT / "docs" / "paper-statements.md"


def updated(text: str, blocks: Mapping[str, Callable[[], str]]) -> str:
    """A text with each block written anew.

    Raises:
        ValueError: the text has no such block.
    """
    for name, block in blocks.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        if not pattern.search(text):
            raise ValueError(f"no block '{name}': put {begin} and {end} into the text")
        content = f"{begin}\n\n{block()}\n\n{end}"
        text = pattern.sub(lambda _, content=content: content, text)
    return text


def speed(folder: Path = RESULTS) -> str:
    """The latest measurement in a few lines: how fast, and what was promised."""
    files = sorted(folder.glob("speed-*.json"))
    if not files:
        return "* Speed: not measured yet on this version; `make bench` does."
    record = json.loads(files[-1].read_text(encoding="utf-8"))
    machine = record["machine"]
    own = [row for row in record["measured"] if row["name"].startswith(OURS)]
    return "\n".join(
        [
            f"* Speed, in control steps of 0.1 s ({machine['cores']} cores of {machine['cpu']}, "
            f"{record['date']}):",
            *(f"    * {_speed_words(row)}" for row in own),
            *(f"* {_verdict(verdict)}" for verdict in record["verdicts"]),
        ]
    )


OURS = "RoboticFish3D"


def _speed_words(row: Mapping[str, Any]) -> str:
    rate = short(row["env_steps_per_s"]["median"])
    threads = f"{row['threads']} thread{'s' * (row['threads'] > 1)}"
    return f"{rate}/s for {row['envs']} fish on {threads}"


def _verdict(verdict: Mapping[str, Any]) -> str:
    head = f"{verdict['claim'][0].upper()}{verdict['claim'][1:]}: at least {verdict['target']:g} "
    if verdict["ratio"] is None:
        return f"{head}times as fast (target); not measured."
    ratio = verdict["ratio"]["median"]
    return f"{head}times as fast (target); measured {ratio:.2g} times: {verdict['verdict']}."


def diagnosis(folder: Path = DIAGNOSIS) -> str:
    """How often the latest full run of the hidden-effect suite was right, as a list."""
    files = sorted(folder.glob("diagnosis-[0-9]*.json"))
    if not files:
        return (
            "* Diagnosis: no full run of the hidden-effect suite is published yet; "
            "`make benchmark-diagnosis` does one."
        )
    record = json.loads(files[-1].read_text(encoding="utf-8"))
    rates = {title: record["overall"][key] for key, title in HEADLINES.items()}
    known = [f"    * {title} in {_share(rate)}" for title, rate in rates.items() if rate]
    return "\n".join([f"* Diagnosis of {record['cases']} hidden cases, {record['date']}:", *known])


HEADLINES = {
    "name_right": "verdict and name right",
    "wrong_single": "a wrong single name",
    "false_alarm": "a false alarm where nothing is wrong",
}
"""Rates of the suite that the README quotes."""


def _share(rate: Mapping[str, float]) -> str:
    low, high = 100 * rate["low"], 100 * rate["high"]
    return f"{rate['count']} of {rate['of']} ({low:.0f} to {high:.0f} %)"


def statements(page: Path = STATEMENTS) -> str:
    """How many of the paper's statements are held, in one line."""
    text = page.read_text(encoding="utf-8").partition("\n## ")[0]
    total = re.search(r"reproduces (\d+) of (\d+) statements", text)
    if total is None:
        raise ValueError(f"{page}: no sentence 'reproduces N of M statements'")
    motions: dict[str, list[bool]] = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 5 and cells[0] != "motion" and "---" not in cells[0]:
            motions.setdefault(cells[0], []).append(cells[4].startswith("held"))
    parts = ", ".join(f"{m} {sum(held)} of {len(held)}" for m, held in motions.items())
    return f"* The model reproduces {total[1]} of {total[2]} statements of the paper ({parts})."


BLOCKS: dict[str, Callable[[], str]] = {
    "speed": speed,
    "agents": agents_report.headline,
    "diagnosis": diagnosis,
    "statements": statements,
}

if __name__ == "__main__":
    README.write_text(updated(README.read_text(encoding="utf-8"), BLOCKS), encoding="utf-8")
    print(f"written: {README}")
