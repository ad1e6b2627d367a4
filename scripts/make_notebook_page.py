"""Executes examples/log-to-policy.ipynb and writes docs/log-to-policy.md from what it prints.

Part of `make docs`; takes one to three minutes. Needs the extras `notebook` and `train`.
"""

from __future__ import annotations

import base64
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOK = ROOT / "examples" / "log-to-policy.ipynb"
PAGE = ROOT / "docs" / "log-to-policy.md"
IMAGES = ROOT / "docs" / "images"
LIMIT_S = 900
INTRODUCED = (
    "*This page is `examples/log-to-policy.ipynb` with its output. "
    "`jupyter execute examples/log-to-policy.ipynb` runs it again.*"
)


def read() -> Any:
    """The notebook without output."""
    import nbformat

    return nbformat.read(NOTEBOOK, as_version=4)


def executed(notebook: Any) -> Any:
    """The notebook with its output; it runs in an empty folder.

    Raises:
        CellExecutionError: A cell fails.
    """
    from nbclient import NotebookClient

    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    os.environ["PATH"] = programs  # for cells that run `robofish`
    with tempfile.TemporaryDirectory(prefix="robofish-") as folder:
        client = NotebookClient(notebook, timeout=LIMIT_S, resources={"metadata": {"path": folder}})
        return client.execute()


def page(notebook: Any) -> tuple[str, dict[str, bytes]]:
    """The page, and its pictures by file name.

    Args:
        notebook: Executed.
    """
    parts, pictures = list[str](), dict[str, bytes]()
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source.strip())
            if len(parts) == 1:
                title, _, rest = parts[0].partition("\n")
                parts = [title, INTRODUCED, rest.strip()]
            continue
        reason = "make docs executes the notebook"
        parts.append(f'```{{.python .no-run data-reason="{reason}"}}\n{cell.source.strip()}\n```')
        for output in cell.outputs:
            parts += _shown(output, pictures)
    return "\n\n".join(parts) + "\n", pictures


def _shown(output: Any, pictures: dict[str, bytes]) -> list[str]:
    """One output of a cell as Markdown."""
    if output.output_type == "stream":
        return [f"```text\n{output.text.strip()}\n```"] if output.name == "stdout" else []
    if "image/png" in output.data:
        name = f"log-to-policy-{len(pictures) + 1}.png"
        pictures[name] = base64.b64decode(output.data["image/png"])
        return [f"![Output of the cell above](images/{name})"]
    return [f"```text\n{output.data['text/plain'].rstrip()}\n```"]


def main() -> None:
    """Writes the page and its pictures."""
    text, pictures = page(executed(read()))
    PAGE.write_text(text, encoding="utf-8")
    for name, content in pictures.items():
        (IMAGES / name).write_bytes(content)
    print(PAGE.relative_to(ROOT))


if __name__ == "__main__":
    main()
