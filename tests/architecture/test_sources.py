"""Files stay short and public things are documented."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAX_LINES = 400
CODE = ("agents", "configs", "examples", "fish_env", "scripts", "tests")
SOURCES = sorted(file for folder in CODE for file in (ROOT / folder).rglob("*.py"))
PUBLIC = [
    file
    for file in SOURCES
    if file.relative_to(ROOT).parts[0] in ("agents", "examples", "fish_env")
]


def name(file: Path) -> str:
    return str(file.relative_to(ROOT))


def undocumented(source: str) -> list[str]:
    """Names of public functions, classes and methods without a docstring; "" is the module."""
    tree = ast.parse(source)
    missing = [] if ast.get_docstring(tree) else [""]
    return missing + [item for item, node in public(tree, "") if not ast.get_docstring(node)]


Documented = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def public(tree: ast.Module | ast.ClassDef, prefix: str) -> Iterator[tuple[str, Documented]]:
    """Public functions and classes of a module or class, and those of its classes."""
    for node in tree.body:
        if isinstance(node, Documented) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from public(node, f"{prefix}{node.name}.")


@pytest.mark.parametrize("file", SOURCES, ids=name)
def test_a_file_has_at_most_400_lines(file):
    assert len(file.read_text(encoding="utf-8").splitlines()) <= MAX_LINES


@pytest.mark.parametrize("file", PUBLIC, ids=name)
def test_every_public_thing_has_a_docstring(file):
    assert undocumented(file.read_text(encoding="utf-8")) == []


def test_the_docstring_check_notices_what_is_missing():
    source = "class A:\n    'doc'\n    def f(self): ...\n    def _g(self): ...\ndef h(): ...\n"
    assert undocumented(source) == ["", "A.f", "h"]
