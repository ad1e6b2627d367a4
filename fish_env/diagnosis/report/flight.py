"""The next experiment as a table of commands to fly."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.headline import EXPERIMENT_FILE
from fish_env.files import write_rows


def write_schedule(answer: Mapping[str, Any], folder: Path) -> list[Path]:
    """Writes ``next_experiment.csv`` where an experiment is proposed.

    Columns: ``t`` (s) and the five commands in SI units (rad, Hz, m). A row holds until the next.

    Args:
        answer: Content of ``diagnosis.json``.
        folder: Where the file goes.

    Returns:
        The file that was written, if any.

    Raises:
        OutputError: It cannot be written.
    """
    schedule = (answer.get("next_experiment") or {}).get("schedule")
    if not schedule:
        return []
    file = folder / EXPERIMENT_FILE
    write_rows(file, ("t", *COMMANDS), schedule, missing=0.0)
    return [file]
