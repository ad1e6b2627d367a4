"""Names that scripts, tests and examples take from the project's modules are there.

Imports inside functions run only when these are called, which for a benchmark may be months later.
"""

import ast
import importlib
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tests.docs.pages import all_blocks

ROOT = Path(__file__).resolve().parents[2]
OWN = ("fish_env", "robofish_agents", "scripts", "tests")
LACKING = {"fish_env.model.composed"}
"""What the code generator completes."""
SHELL_LINE = re.compile(r"^(\s*\w+ = |\s*)!.*$", re.MULTILINE)
"""What a notebook hands to the shell."""
FOLDERS = ("agents/robofish_agents", "examples", "fish_env", "scripts", "tests")
FILES = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]


def module_of(name: str) -> ModuleType | None:
    """A module of the project; None for another one, or where a package that it needs lacks."""
    if name.split(".")[0] not in OWN or name in LACKING:
        return None
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name and error.name.split(".")[0] in OWN:
            raise
        return None


def is_module(name: str) -> bool:
    """Whether there is a module of this name."""
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:  # what it would be in is no package
        return False


def missing(tree: ast.AST) -> Iterator[str]:
    """Names that code takes from modules which do not have them."""
    bound: dict[str, ModuleType] = {}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or node.level or node.module is None:
            continue
        module = module_of(node.module)
        for alias in node.names if module else ():
            inner = f"{node.module}.{alias.name}"
            if not hasattr(module, alias.name) and not is_module(inner):
                yield inner
            elif isinstance(getattr(module, alias.name, None), ModuleType):
                bound[alias.asname or alias.name] = getattr(module, alias.name)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            owner = bound.get(node.value.id)
            own = owner is not None and owner.__name__.split(".")[0] in OWN
            if own and isinstance(node.ctx, ast.Load) and not hasattr(owner, node.attr):
                yield f"{owner.__name__}.{node.attr}"


@pytest.mark.parametrize("folder", FOLDERS)
def test_names_exist(folder):
    found = {
        str(path.relative_to(ROOT)): names
        for path in FILES
        if path.is_relative_to(ROOT / folder)
        if (names := sorted(set(missing(ast.parse(path.read_text())))))
    }
    assert not found


def test_names_in_the_code_of_pages_exist():
    """Also in code that needs what the tests do not have, a GPU for one."""
    found = {
        block.name: names
        for block in all_blocks("python")
        if (names := list(missing(ast.parse(SHELL_LINE.sub(r"\1None", block.text)))))
    }
    assert not found


def test_names_that_do_not_exist_are_found():
    code = """
from fish_env.units import nothing_of_the_kind
from fish_env import files
def later():
    from fish_env.errors import NoSuchError, ConfigError
    return files.no_such_function, files.write_text
"""
    with pytest.raises(ModuleNotFoundError):
        list(missing(ast.parse(code)))
    code = code.replace("from fish_env.units import nothing_of_the_kind\n", "")
    assert list(missing(ast.parse(code))) == [
        "fish_env.errors.NoSuchError",
        "fish_env.files.no_such_function",
    ]
