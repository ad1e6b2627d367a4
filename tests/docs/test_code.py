"""Every piece of code in the README and the pages runs as it stands, page by page, in order."""

import json
import re
import shutil
from pathlib import Path

import pytest
from typer.main import get_command

from fish_env.cli import app
from fish_env.data import load_dataset
from tests.docs.pages import PAGES, ROOT, SHELL, Block, all_blocks, blocks, fences, run_page

TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
COMMANDS = set(get_command(app).commands)  # type: ignore[attr-defined]
EXTRAS = set(
    re.findall(
        r"^(\w+) = \[",
        (ROOT / "pyproject.toml").read_text().split("optional-dependencies]")[1],
        re.M,
    )
)


COMPILING = {"your-own.md", "evaluation.md", "paths.md"}
"""Pages whose code needs kernels that no other test does, a minute or so to compile."""


def with_its_mark(page: Path):
    """A page as a parameter of a test."""
    marks = [pytest.mark.slow, pytest.mark.long] if page.name in COMPILING else []
    return pytest.param(page, id=page.name, marks=marks)


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty folder with the examples, to run in."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", [with_its_mark(page) for page in PAGES])
def test_the_code_of_a_page_runs(page: Path, folder):
    run_page(page, folder)
    if page.name == "tutorial.md":
        answer = json.loads((folder / "out/trials/diagnosis.json").read_text())
        assert answer["verdict"] == "cause"
        assert [cause["name"] for cause in answer["causes"]] == ["servo_lag"]


@pytest.mark.parametrize(
    ("code", "what"),
    [
        ("```python\nx = 1\n```\n\n```python\nassert x == 2\n```\n", AssertionError),
        ("```python\nimport warnings\n\nwarnings.warn('old', stacklevel=1)\n```\n", UserWarning),
        ("```sh\nrobofish info --fish no-such-fish\n```\n", AssertionError),
        ("```sh\nfalse\ntrue\n```\n", AssertionError),
        ("* a list\n\n    ```python\n    1 / 0\n    ```\n", ZeroDivisionError),
    ],
)
def test_broken_code_on_a_page_is_noticed(code, what, folder):
    page = folder / "page.md"
    page.write_text(code)
    with pytest.raises(what):
        run_page(page, folder)


def test_a_page_writes_its_titled_files_and_leaves_out_what_is_marked(folder):
    page = folder / "page.md"
    page.write_text(
        '```yaml title="data/a.yaml"\na: 1\n```\n\n'
        '```{.sh .no-run data-reason="never"}\nfalse\n```\n\n'
        "```sh\ngrep -q 1 data/a.yaml\n```\n\n```python\nopen('data/a.yaml').close()\n```\n"
    )
    run_page(page, folder)
    assert [block.not_run for block in fences(page)] == [None, "never", None, None]


def test_what_is_not_run_says_why():
    assert [block.name for page in PAGES for block in fences(page) if block.not_run == ""] == []


def test_nothing_that_runs_installs_or_sets_up():
    """Mark such a block ```` ```{.sh .no-run data-reason="installs packages"} ````."""
    running = [block for block in all_blocks(*SHELL) if block.not_run is None]
    setting_up = re.compile(r"^\s*(\S*pip|make|apt|apt-get|git clone)\b", re.MULTILINE)
    assert [block.name for block in running if setting_up.search(block.text)] == []


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


@pytest.mark.parametrize("block", all_blocks(*SHELL), ids=lambda block: block.name)
def test_shell_commands_exist(block: Block):
    """Also where a block is not run."""
    assert [line for line in block.text.splitlines() if unknown(line)] == []


def test_the_check_of_shell_commands_notices_unknown_ones():
    lines = ["make tea", "robofish fly", 'pip install ".[wings]"']
    assert all(unknown(line) for line in lines)
    assert not any(unknown(line) for line in ["make test", "robofish info", "pip install ."])


@pytest.mark.parametrize("number", [0, 1])
def test_the_datasets_of_the_format_page_can_be_read(number, tmp_path):
    page = ROOT / "docs" / "data-format.md"
    whole = [block.text for block in blocks(page, "yaml") if block.text.startswith("format:")]
    description, table = whole[number], blocks(page, "csv")[number].text
    file = re.search(r"file: ([\w.-]+\.csv)", description)
    assert file is not None
    (tmp_path / "dataset.yaml").write_text(description)
    (tmp_path / file[1]).write_text(table)
    assert load_dataset(tmp_path).name == ("tank-trials", "speed-over-frequency")[number]
