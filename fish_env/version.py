"""The version of the package, as it stands in the files that it writes."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

VERSION = "0.2.0"
PROGRAM = "robotic-fish"
"""What stands in each file that is written, of whichever version."""
WRITER = f"{PROGRAM} {VERSION}"
WRITTEN_BY = "Written by"
"""How the comment above a YAML text begins."""


def stamped(text: str) -> str:
    """A YAML text below a comment that names the version; readers pass the comment over.

    Args:
        text: What is written otherwise.
    """
    return f"# {WRITTEN_BY} {WRITER}.\n{text}"


def versioned(content: Mapping[str, Any]) -> dict[str, Any]:
    """The content of a JSON file with the version in front.

    Args:
        content: What is written otherwise; a version of its own stays.
    """
    return {"version": VERSION, **content}


def generator() -> str:
    """The element of an HTML page that names the version."""
    return f'<meta name="generator" content="{html.escape(WRITER)}">'
