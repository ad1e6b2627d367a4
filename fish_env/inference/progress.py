"""Telling whoever waits what is being done."""

from __future__ import annotations

from collections.abc import Callable

Report = Callable[[str], None]
"""Told the name of each step."""


def silent(step: str) -> None:
    """Tells nobody."""
