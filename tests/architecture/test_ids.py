"""The text of parameters and causes is made and taken apart in one module."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2] / "fish_env"
MADE_IN = ROOT / "inference" / "hypotheses.py"
FOLDERS = ("inference", "identification", "diagnosis")
STARTS = ("effects.", "parameter:")


def texts_of_ids(source: str) -> list[str]:
    """Strings in code that begin as the text of an id does; docstrings and comments are prose."""
    tree = ast.parse(source)
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    strings = (node for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return [
        str(node.value)
        for node in strings
        if id(node) not in prose and str(node.value).startswith(STARTS)
    ]


def test_no_other_module_knows_how_ids_are_written():
    files = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.py"))]
    found = {str(file): texts_of_ids(file.read_text()) for file in files if file != MADE_IN}
    assert not {file: texts for file, texts in found.items() if texts}
    assert set(texts_of_ids(MADE_IN.read_text())) == {*STARTS}


@pytest.mark.parametrize(
    "line",
    [
        'SCALE = "effects.frequency_scale.scale"',
        'path = f"effects.{name}.{key}"',
        'name.removeprefix("parameter:")',
    ],
)
def test_the_check_notices_text_of_ids(line):
    assert texts_of_ids(f'"""effects.a.b"""\n{line}\n')
