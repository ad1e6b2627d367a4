"""Results as numbers: what `--json` of every command writes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from fish_env.files import STANDARD, write_text
from fish_env.version import versioned


def console_for(*outputs: Path | None) -> Console:
    """Returns where words go: standard error if an output, `-`, takes standard output.

    Args:
        outputs: Files that a command writes; None is passed over.
    """
    return Console(stderr=any(output is not None and str(output) == STANDARD for output in outputs))


def write_json(console: Console, file: Path, content: Mapping[str, Any] | list[Any]) -> None:
    """Writes results as JSON and names the file; what is not finite becomes null.

    Args:
        console: Where the file is named.
        file: The file; `-` is standard output.
        content: Nested mappings, lists, texts and numbers, NumPy's too.

    Raises:
        OutputError: The file cannot be written.
    """
    from fish_env.comparison.errors import plain  # slow to import, and every command imports this

    content = versioned(content) if isinstance(content, Mapping) else content
    write_text(file, json.dumps(plain(content), indent=1, allow_nan=False) + "\n")
    if str(file) != STANDARD:
        console.print(f"numbers: {file}", soft_wrap=True, markup=False)
