"""Imports go one way, and importing the package loads nothing heavy that it may not need."""

import ast
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINTER = Path(sys.executable).with_name("lint-imports")
# What agents act on; the one style of pictures and the options of commands, so that theirs look
# alike; and the one way to read files.
OPEN_TO_AGENTS = {
    "archives",
    "arrays",
    "cluster",
    "commands",
    "errors",
    "files",
    "reading",
    "yaml_text",
    "params",
    "trajectory",
    "simulator",
    "envs",
    "gpu",
    "plotting",
    "rendering",
    "replay",
    "version",
}
BELOW_INFERENCE = {f"fish_env.{part}" for part in ("arrays", "errors", "inference", "threads")}
NUMERICS = {"numpy", "scipy", "numba", *BELOW_INFERENCE}
NOT_ON_IMPORT = ("torch", "matplotlib", "pandas", "stable_baselines3", "pyarrow", "pygame")


def run_linter(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [str(LINTER), "--no-cache"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def foreign_imports(source: str) -> set[str]:
    """Modules directly below fish_env that a source imports and agents may not."""
    imported: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module == "fish_env":
            imported |= {f"fish_env.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported.add(node.module)
    parts = [name.split(".") for name in imported]
    return {part[1] for part in parts if part[0] == "fish_env" and len(part) > 1} - OPEN_TO_AGENTS


def test_the_contracts_hold():
    result = run_linter(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("fish_env/errors.py", "import fish_env.params"),
        ("fish_env/params.py", "import fish_env.model"),
        ("fish_env/params.py", "import robofish_agents"),
        ("fish_env/inference/box_qp.py", "import fish_env.params"),
        ("fish_env/unheard_of.py", ""),
    ],
)
def test_the_contracts_notice_a_wrong_import_or_an_unplaced_module(tmp_path, module, line):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for folder in ("agents", "fish_env", "fish_env/inference"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").touch()
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    contract = tool["importlinter"]["contracts"][2]
    forbidden = (*contract["forbidden_modules"], *contract["source_modules"][1:])
    for part in (
        "arrays",
        "errors",
        "threads",
        *(name.split(".")[1] for name in forbidden if "." in name),
    ):
        (tmp_path / f"fish_env/{part}.py").touch()
    assert run_linter(tmp_path).returncode == 0
    (tmp_path / module).write_text(f"{line}\n")
    assert run_linter(tmp_path).returncode == 1


@pytest.mark.parametrize("file", sorted((ROOT / "agents").rglob("*.py")), ids=str)
def test_agents_use_only_what_is_open_to_them(file):
    assert foreign_imports(file.read_text(encoding="utf-8")) == set()


def test_the_agents_check_notices_a_kernel_import():
    assert foreign_imports("from fish_env.model.tail import force") == {"model"}
    assert foreign_imports("from fish_env import diagnosis, envs") == {"diagnosis"}
    assert foreign_imports("import fish_env.effects") == {"effects"}


def roots(source: str) -> set[str]:
    """Packages that a source imports; of this project, the part."""
    imported = {a.name for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Import)
                for a in n.names}  # fmt: skip
    nodes = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.ImportFrom)]
    imported |= {str(node.module) for node in nodes}
    parts = [name.split(".") for name in imported]
    return {".".join(p[:2]) if p[0] == "fish_env" else p[0] for p in parts}


@pytest.mark.parametrize("file", sorted((ROOT / "fish_env/inference").rglob("*.py")), ids=str)
def test_inference_needs_numerics_only(file):
    foreign = roots(file.read_text(encoding="utf-8")) - NUMERICS
    assert foreign <= sys.stdlib_module_names


def test_the_inference_check_notices_other_packages():
    source = "import pandas\nfrom fish_env.params import load_fish\nimport scipy.linalg"
    assert roots(source) - NUMERICS == {"pandas", "fish_env.params"}


def loaded_by(statement: str) -> set[str]:
    """Heavy modules that a fresh interpreter has loaded after a statement."""
    code = f"{statement}; import sys; print(*[m for m in {NOT_ON_IMPORT!r} if m in sys.modules])"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return set(result.stdout.split())


def test_importing_the_package_loads_no_heavy_module():
    assert loaded_by("import fish_env") == set()


def test_the_heavy_module_check_notices_one():
    assert loaded_by("import fish_env, pandas") >= {"pandas"}
