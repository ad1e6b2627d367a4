"""Files stay short and public things are documented."""

import ast
import re
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
TEXTS = [
    file
    for folder in (*CODE, ".ci", "docs")
    for file in sorted((ROOT / folder).rglob("*"))
    if file.suffix in (".py", ".md", ".yaml", ".json", ".csv", ".c", "")
    if file.is_file()
] + [file for file in sorted(ROOT.glob("*.*")) if file.suffix in (".md", ".toml", ".txt")]
ONE_MACHINE = re.compile(r"(?<![\w.}])/(home|root|tmp|work|opt|mnt|Users)/|[A-Z]:\\\\Users")
"""Paths that exist on one person's machine only."""


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


def test_no_file_names_a_path_of_one_machine():
    named = [f for f in TEXTS if ONE_MACHINE.search(f.read_text(encoding="utf-8"))]
    assert [name(file) for file in named] == []


def test_the_path_check_notices_one():
    assert ONE_MACHINE.search('open("/' + 'home/ada/fish.yaml")')
    assert not ONE_MACHINE.search("../shared/data and https://example.org/home/page")
