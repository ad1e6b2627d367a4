"""Files stay short and public things are documented."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAX_LINES, MAX_FUNCTION = 400, 60
SHORT = ("inference", "rigidbody", "identification", "diagnosis")
"""Folders whose functions each hold one step of the inference. Templates are compiled whole."""
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


def long_functions(source: str) -> list[str]:
    """Names of functions of more lines than one step of a computation needs."""
    nodes = ast.walk(ast.parse(source))
    functions = [n for n in nodes if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [f.name for f in functions if (f.end_lineno or 0) - f.lineno >= MAX_FUNCTION]


INFERRING = [
    file
    for folder in SHORT
    for file in sorted((ROOT / "fish_env" / folder).rglob("*.py"))
    if not file.stem.endswith("_template")
]


@pytest.mark.parametrize("file", INFERRING, ids=name)
def test_a_function_of_the_inference_has_at_most_60_lines(file):
    assert long_functions(file.read_text(encoding="utf-8")) == []


def test_the_length_check_notices_a_long_function():
    body = "    x = 1\n" * MAX_FUNCTION
    assert long_functions("def f():\n" + body) == ["f"]
    assert long_functions("def f():\n" + body[: -len("    x = 1\n")]) == []


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


WRITES = {"write_text", "write_bytes", "savefig", "to_parquet", "write_frames", "unlink", "rmtree"}
"""Calls that write or remove; only fish_env.files may do so where a file has its final name."""
REMOVERS = {
    "agents/robofish_agents/training/lock.py",
    "fish_env/diagnosis/written.py",
    "fish_env/model/compose.py",
    "fish_env/model/kernel_cache.py",
}
"""Modules that remove files, of which they know that they wrote them."""


def careless_writes(source: str) -> list[str]:
    """Calls that write a file outside a ``with replacing(...)``, by name and line."""
    found: list[str] = []

    def look(node: ast.AST, safe: bool) -> None:
        if isinstance(node, ast.With):
            safe = safe or any("replacing(" in ast.unparse(item) for item in node.items)
        if isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            method = isinstance(node.func, ast.Attribute)
            opened = name == "open" and any(
                isinstance(value, ast.Constant) and str(value.value)[:1] in "wax"
                for value in (*node.args, *(k.value for k in node.keywords if k.arg == "mode"))
            )
            helper = name in ("write_text", "write_bytes") and not method
            if (name in WRITES or opened) and not helper and not safe:
                found.append(f"{name}:{node.lineno}")
        for child in ast.iter_child_nodes(node):
            look(child, safe)

    look(ast.parse(source), False)
    return found


@pytest.mark.parametrize("file", [f for f in PUBLIC if name(f) != "fish_env/files.py"], ids=name)
def test_files_are_written_by_the_one_helper(file):
    found = careless_writes(file.read_text(encoding="utf-8"))
    if name(file) in REMOVERS:
        found = [call for call in found if not call.startswith(("unlink", "rmtree"))]
    assert found == []


def test_the_writing_check_notices_each_kind():
    for line in (
        "path.write_text(text)",
        "open(path, 'w')",
        "path.open('ab')",
        "figure.savefig(path)",
        "file.unlink()",
    ):
        assert careless_writes(line), line
    safe = "with replacing(path) as part, part.open('w') as stream:\n    figure.savefig(part)\n"
    assert careless_writes(safe + "write_text(path, text)\nopen(path)\nopen(path, 'rb')") == []
