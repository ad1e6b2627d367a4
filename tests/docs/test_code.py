"""Every piece of code in the README and the pages runs as it stands."""

import re
import shutil
import warnings
from pathlib import Path

import pytest
from typer.main import get_command

from fish_env.cli import app
from fish_env.data import load_dataset
from tests.docs.pages import ROOT, Block, all_blocks, blocks

PYTHON = all_blocks("python")
SHELL = all_blocks("sh")
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
COMMANDS = set(get_command(app).commands)  # type: ignore[attr-defined]
EXTRAS = set(
    re.findall(
        r"^(\w+) = \[",
        (ROOT / "pyproject.toml").read_text().split("optional-dependencies]")[1],
        re.M,
    )
)


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty folder with the examples, to run in."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("block", PYTHON, ids=lambda block: block.name)
def test_python_runs(block: Block, folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(block.text, block.name, "exec"), {"__name__": "__main__"})


def test_the_readme_runs_the_simulator_and_the_environment():
    code = "".join(block.text for block in blocks(ROOT / "README.md", "python"))
    assert "Simulator(" in code
    assert "env.step(" in code


def unknown(line: str) -> str:
    """What a shell line calls that does not exist; empty if all does."""
    words = line.partition("#")[0].split()
    if words[:1] == ["make"]:
        return "" if words[1] in TARGETS else words[1]
    if words[:1] == ["robofish"]:
        return "" if words[1] in COMMANDS else words[1]
    extras = re.findall(r"\[(\w+)\]", line)
    return next((extra for extra in extras if extra not in EXTRAS), "")


@pytest.mark.parametrize("block", SHELL, ids=lambda block: block.name)
def test_shell_commands_exist(block: Block):
    assert [line for line in block.text.splitlines() if unknown(line)] == []


def test_the_check_of_shell_commands_notices_unknown_ones():
    lines = ["make tea", "robofish fly", 'pip install ".[wings]"']
    assert all(unknown(line) for line in lines)
    assert not any(unknown(line) for line in ["make test", "robofish info", "pip install ."])


@pytest.mark.parametrize("number", [0, 1])
def test_the_datasets_of_the_format_page_can_be_read(number, tmp_path):
    page = ROOT / "docs" / "data-format.md"
    description, table = (blocks(page, kind)[number].text for kind in ("yaml", "csv"))
    file = re.search(r"file: ([\w.-]+\.csv)", description)
    assert file is not None
    (tmp_path / "dataset.yaml").write_text(description)
    (tmp_path / file[1]).write_text(table)
    assert load_dataset(tmp_path).name == ("tank-trials", "speed-over-frequency")[number]
