"""Draws the import graphs of docs/developing.md from the imports themselves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from scripts.import_graph import graph_of, imports_of
from scripts.layered_drawing import drawing

ASSETS = Path(__file__).resolve().parents[1] / "docs" / "assets"
INFERENCE = "fish_env.inference."


def main() -> None:
    for name, text in pictures().items():
        (ASSETS / name).write_text(text, encoding="utf-8")


def pictures() -> Mapping[str, str]:
    """The pictures by the name of their file."""
    imports = imports_of("robofish_agents", "fish_env")
    return {
        "imports.svg": drawing(graph_of(imports, part_of), "Imports among the parts of fish_env"),
        "imports-inference.svg": drawing(
            graph_of(imports, module_of_inference), "Imports among the modules of inference"
        ),
    }


def part_of(module: str) -> str:
    """``robofish_agents``, or what stands directly below ``fish_env``; "" for the latter itself."""
    package, *below = module.split(".")
    return package if package == "robofish_agents" else "".join(below[:1])


def module_of_inference(module: str) -> str:
    """Name below ``fish_env.inference``; "" for other modules."""
    return module.removeprefix(INFERENCE) if module.startswith(INFERENCE) else ""


if __name__ == "__main__":
    main()
