"""Writes the generated parts of README.md: `python -m scripts.update_readme`.

They stand between the comments `<!-- NAME -->` and `<!-- end of NAME -->`: the latest speed
measurement in scripts/bench/results, and how many of the paper's statements are held.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from scripts.bench.report import short

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
RESULTS = ROOT / "scripts" / "bench" / "results"
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
    """The latest measurement as a table, with what was promised."""
    files = sorted(folder.glob("speed-*.json"))
    if not files:
        return "Not measured yet on this version: `make bench` fills in the table."
    record = json.loads(files[-1].read_text(encoding="utf-8"))
    machine = record["machine"]
    versions = ", ".join(f"{n} {v}" for n, v in record["versions"].items() if v != "not installed")
    return "\n".join(
        [
            "| environment | fish | threads | env steps/s | simulated s per s |",
            "| --- | --: | --: | --: | --: |",
            *(_speed_row(row) for row in record["measured"]),
            *(f"| {row['name']} | | | not measured | |" for row in record["missing"]),
            "",
            *(f"* {_verdict(verdict)}" for verdict in record["verdicts"]),
            "",
            f"Measured {record['date']} by `make bench` on {machine['cores']} cores of "
            f"{machine['cpu']}, Python {machine['python']}; {versions}. All in one process, in "
            "turn; medians. Control periods and physics steps differ: the "
            f"[full table](scripts/bench/results/{files[-1].stem}.md) has them.",
        ]
    )


def _speed_row(row: Mapping[str, Any]) -> str:
    rate = row["env_steps_per_s"]["median"]
    return (
        f"| {row['name']} | {row['envs']} | {row['threads']} | {short(rate)} "
        f"| {short(row['simulated_s_per_s'])} |"
    )


def _verdict(verdict: Mapping[str, Any]) -> str:
    head = f"{verdict['claim'][0].upper()}{verdict['claim'][1:]}: at least {verdict['target']:g} "
    if verdict["ratio"] is None:
        return f"{head}times as fast is the aim; not measured."
    ratio = verdict["ratio"]["median"]
    return f"{head}times as fast is the aim; it is {ratio:.2g} times: {verdict['verdict']}."


def statements(page: Path = STATEMENTS) -> str:
    """How many of the paper's statements are held, for each motion."""
    text = page.read_text(encoding="utf-8").partition("\n## ")[0]
    total = re.search(r"(\d+) of (\d+) statements are held", text)
    if total is None:
        raise ValueError(f"{page}: no sentence 'N of M statements are held'")
    motions: dict[str, list[bool]] = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 5 and cells[0] != "motion" and "---" not in cells[0]:
            motions.setdefault(cells[0], []).append(cells[4].startswith("held"))
    rows = [f"| {m} | {sum(held)} of {len(held)} |" for m, held in motions.items()]
    head = ["| motion | statements held |", "| --- | --- |"]
    return "\n".join([*head, *rows, f"| all | {total[1]} of {total[2]} |"])


BLOCKS: dict[str, Callable[[], str]] = {"speed": speed, "statements": statements}

if __name__ == "__main__":
    README.write_text(updated(README.read_text(encoding="utf-8"), BLOCKS), encoding="utf-8")
    print(f"written: {README}")
