"""The pages that people read, and the code in them."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@dataclass(frozen=True)
class Block:
    """A fenced piece of code: its language, text, page and line."""

    language: str
    text: str
    page: Path
    line: int

    @property
    def name(self) -> str:
        """Where it stands."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(page: Path, language: str) -> list[Block]:
    """All blocks of a language in a page."""
    text = page.read_text(encoding="utf-8")
    fences = re.finditer(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [Block(language, m[1], page, text[: m.start()].count("\n") + 1) for m in fences]


def all_blocks(language: str) -> list[Block]:
    """All blocks of a language in all pages."""
    return [block for page in PAGES for block in blocks(page, language)]
