"""The pages that people read, and the code in them.

markdown-it-py finds the fences (it reads CommonMark as the specification says, lists and nested
fences included). What runs them is here, because pages mix Python with commands in one folder and
name files by the fence's title, which pytest-examples, mktestdocs and sybil leave to the caller.
"""

import os
import re
import subprocess
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHELL = ("sh", "bash", "console")
NOT_RUN = "no-run"


@dataclass(frozen=True)
class Block:
    """A fenced piece of code.

    Attributes:
        language: as the fence says.
        text: its lines.
        page: file.
        line: of the fence, from 1.
        title: file that the reader is asked to write it to; empty if none.
        not_run: why it does not run here; None if it does.
    """

    language: str
    text: str
    page: Path
    line: int
    title: str = ""
    not_run: str | None = None

    @property
    def name(self) -> str:
        """Where it stands."""
        inside = self.page.is_relative_to(ROOT)
        return f"{self.page.relative_to(ROOT) if inside else self.page.name}:{self.line}"


def fences(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order.

    A fence says ```` ```python ````, ```` ```yaml title="trials/dataset.yaml" ```` or
    ```` ```{.sh .no-run data-reason="why"} ````.
    """
    tokens = MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8"))
    return [_block(t.info, t.content, page, t.map) for t in tokens if t.type == "fence"]


def _block(info: str, text: str, page: Path, lines: list[int] | None) -> Block:
    options = dict(re.findall(r'([\w-]+)="([^"]*)"', info))
    bare = re.sub(r'[\w-]+="[^"]*"', "", info)
    language, *classes = re.findall(r"[\w+-]+", bare) or [""]
    reason = options.get("data-reason", "") if NOT_RUN in classes else None
    line = lines[0] + 1 if lines else 0
    return Block(language, text, page, line, options.get("title", ""), reason)


def blocks(page: Path, language: str) -> list[Block]:
    """All blocks of a language in a page."""
    return [block for block in fences(page) if block.language == language]


def all_blocks(*languages: str) -> list[Block]:
    """All blocks of some languages in all pages."""
    return [block for page in PAGES for language in languages for block in blocks(page, language)]


def run_page(page: Path, folder: Path) -> None:
    """Does what a reader of a page does, in order: writes its titled files and runs its code.

    Python blocks share one namespace; a warning is an error. The working folder must be `folder`.

    Raises:
        AssertionError: a command failed; the message has the page, the line and what was printed.
        Exception: whatever a Python block raises, with the page's line in its traceback.
    """
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in fences(page):
        if block.not_run is not None:
            continue
        if block.title:
            file = folder / block.title
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            _run_python(block, namespace)
        elif block.language in SHELL:
            _run_shell(block, folder)


def _run_python(block: Block, namespace: dict[str, Any]) -> None:
    code = compile("\n" * block.line + block.text, str(block.page), "exec")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(code, namespace)


def _run_shell(block: Block, folder: Path) -> None:
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-u", "-o", "pipefail", "-c", block.text],
        cwd=folder,
        env={**os.environ, "PATH": programs},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{block.name} ends with {done.returncode}:\n{done.stdout}"
