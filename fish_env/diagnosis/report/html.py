"""Small pieces of HTML: tables, figures, sections."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from pathlib import Path

THEMED = {
    "#000000": "currentColor",
    "#222222": "currentColor",
    "#ffffff": "none",
    "#fefefe": "var(--rf-card)",
    "#dddddd": "var(--rf-rule)",
    "#0072b2": "var(--rp-extended)",
    "#d55e00": "var(--rp-baseline)",
}
"""Colours of the drawings -> what follows the reader's light or dark ground."""


def text(value: object) -> str:
    """Any value, safe inside HTML."""
    return html.escape(str(value))


def marked(words: str) -> str:
    """A sentence whose parts between backticks are code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text(words))


def number(value: float | None) -> str:
    """Three significant digits; a dash where there is no number."""
    return "–" if value is None else f"{value:.3g}"


def section(title: str, *parts: str, key: str = "") -> str:
    """A section with a heading; empty where all its parts are."""
    body = "\n".join(part for part in parts if part)
    if not body:
        return ""
    name = f' id="{text(key)}"' if key else ""
    return f"<section{name}>\n<h2>{text(title)}</h2>\n{body}\n</section>"


def paragraph(words: str, kind: str = "") -> str:
    """A paragraph of plain words."""
    name = f' class="{kind}"' if kind else ""
    return f"<p{name}>{text(words)}</p>" if words else ""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "") -> str:
    """A table of ready HTML cells; the first column names the row. Empty without rows."""
    if not rows:
        return ""
    head = "".join(f'<th scope="col">{text(name)}</th>' for name in heads)
    lines = [
        f'<tr><th scope="row">{row[0]}</th>' + "".join(f"<td>{cell}</td>" for cell in row[1:])
        + "</tr>"
        for row in rows
    ]  # fmt: skip
    title = f"<caption>{text(caption)}</caption>" if caption else ""
    return (
        f'<div class="rp-scroll" tabindex="0"><table>{title}<thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def figure(svg: Path, caption: str, kind: str = "") -> str:
    """A drawing inside the page; its colours follow the reader's ground.

    Args:
        svg: The drawing.
        caption: Below it, and for readers who do not see it.
        kind: Class of the figure; "rp-fit" shrinks it to a phone's width.
    """
    name = f' class="{kind}"' if kind else ""
    return (
        f'<figure{name} role="img" aria-label="{html.escape(caption, quote=True)}">'
        f'<div class="rp-scroll" tabindex="0">{inline(svg.read_text(encoding="utf-8"))}</div>'
        f"<figcaption>{text(caption)}</figcaption></figure>"
    )


def inline(svg: str) -> str:
    """An SVG file as an element of a page: no prologue, no metadata, themed colours."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    for colour, themed in THEMED.items():
        svg = re.sub(rf"(?<=[ :]){colour}\b", themed, svg)
    return svg


def folded(summary: str, body: str) -> str:
    """A part that opens when asked for; empty where the body is."""
    return f"<details><summary>{text(summary)}</summary>{body}</details>" if body else ""
