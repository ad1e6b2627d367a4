"""Long runs in parts: each ends when asked to and has a result of its own, and all are added up."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

AMOUNT = {"batch": "steps", "turns": "hours"}
"""What a part of the soak counts."""


@contextmanager
def until_stopped() -> Iterator[Callable[[], bool]]:
    """Yields a function that says whether Ctrl-C or SIGTERM has asked this process to end.

    A second Ctrl-C ends it at once.
    """
    asked: list[int] = []

    def ask(number: int, frame: FrameType | None) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def results_of(part: str, folder: Path) -> list[Path]:
    """The results of a part of the soak, the earliest first."""
    return sorted(folder.glob(f"soak-{part}-*.json"), key=lambda file: (len(file.stem), file.stem))


def added_up(part: str, folder: Path) -> list[str]:
    """A line for each run of a part, with the slope of its memory, and one for all of them."""
    files, unit = results_of(part, folder), AMOUNT[part]
    runs = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    lines = [
        f"{file.name}: commit {run['commit']}, {run[unit]:,} {unit}, "
        f"{run['resources']['memory_mb_an_hour']} MB an hour, grew: "
        f"{', '.join(run['resources']['grew']) or 'nothing'}"
        for file, run in zip(files, runs, strict=True)
    ]
    return [*lines, f"{part}: {_total(runs, unit):,} {unit} in {len(runs)} runs"]


def _total(runs: Sequence[dict[str, Any]], unit: str) -> float:
    total = sum(run[unit] for run in runs)
    return round(total, 4) if isinstance(total, float) else total
