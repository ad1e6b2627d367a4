"""Results that took long: kept as they come, and written under the day they were measured."""

from __future__ import annotations

import datetime
import json
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fish_env.files import write_bytes

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "results"


def kept(file: Path, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """A result: read back if there is one, made and put in place at once if there is none."""
    if not file.exists():
        write_bytes(file, json.dumps(make(), indent=1, default=str).encode())
    result: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return result


def today() -> str:
    """The day of a result, as its file name has it."""
    return datetime.date.today().isoformat()


def write_dated(
    folder: Path, kind: str, content: Mapping[str, Any], page: str = "", beside: bool = False
) -> Path:
    """Writes ``<kind>-<date>.json`` with date and commit and, where there is a page, ``.md``.

    Args:
        folder: where.
        kind: of the result.
        content: of the JSON file.
        page: of the Markdown file.
        beside: number the file where there is one of that day, instead of replacing it.

    Returns:
        The JSON file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    file, number = folder / f"{kind}-{today()}.json", 2
    while beside and file.exists():
        file, number = folder / f"{kind}-{today()}-{number}.json", number + 1
    whole = {"date": today(), "commit": commit(), **content}
    file.write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    if page:
        file.with_suffix(".md").write_text(page, encoding="utf-8")
    return file


def commit() -> str:
    """Commit of the sources, with a plus sign where fish_env differs from it."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
        return done.stdout.strip()

    changed = "+" if git("status", "--porcelain", "fish_env") else ""
    return (git("rev-parse", "--short", "HEAD") or "unknown") + changed
