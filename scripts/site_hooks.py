"""What mkdocs does not do by itself: roles of Sphinx in docstrings become code."""

from __future__ import annotations

import re
from typing import Any

ROLE = re.compile(r":(?:class|func|meth|mod|data|attr|exc):<code>~?(?P<name>[^<]*)</code>")


def on_page_content(content: str, **_: Any) -> str:
    """Called by mkdocs with the HTML of each page."""
    return ROLE.sub(r"<code>\g<name></code>", content)
