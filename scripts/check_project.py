"""The code-level items of pyOpenSci and of SPEC 0, 1 and 7: `python -m scripts.check_project`.

Prints one line an item and fails if one does not hold. Sources: pyOpenSci's checklist for editors
(packaging guide), and scientific-python.org/specs.
"""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = {"3.12": date(2023, 10, 2), "3.13": date(2024, 10, 7), "3.14": date(2025, 10, 7)}
"""Version of Python -> its release. SPEC 0 supports one for 36 months."""
CORE = {
    "numpy": {"2.2.0": date(2024, 12, 8), "2.3.0": date(2025, 6, 7)},
    "scipy": {"1.15.0": date(2025, 1, 3), "1.16.0": date(2025, 6, 22)},
    "pandas": {"2.3.0": date(2025, 6, 5)},
    "matplotlib": {"3.10.0": date(2024, 12, 13)},
}
"""Core packages of SPEC 0 -> release of versions. It supports one for 24 months."""
FILES = (
    "README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md", "SECURITY.md",
    "CITATION.cff", ".pre-commit-config.yaml", "docs/index.md", "docs/tutorial.md", "docs/api.md",
)  # fmt: skip
HEAVY = ("matplotlib", "pandas", "torch", "pygame", "stable_baselines3", "h5py")
"""SPEC 1: not loaded before they are needed."""
GLOBAL_RANDOM = re.compile(r"np\.random\.(seed|rand|randn|randint|normal|uniform|RandomState)\b")


def months(since: date, today: date) -> int:
    """Whole months between two days.

    Args:
        since: The earlier.
        today: The later.
    """
    return (today.year - since.year) * 12 + today.month - since.month - (today.day < since.day)


def missing_files(root: Path = ROOT) -> list[str]:
    """pyOpenSci: files that a project needs and that are not there."""
    return [name for name in FILES if not (root / name).is_file()]


def missing_metadata(project: dict[str, Any]) -> list[str]:
    """pyOpenSci: keys that the project table lacks."""
    keys = ("name", "version", "description", "readme", "license", "authors", "requires-python")
    return [key for key in (*keys, "keywords", "classifiers") if not project.get(key)]


def refused_versions(project: dict[str, Any], today: date) -> list[str]:
    """SPEC 0: versions of Python and of core packages that are supported still and refused."""
    python = SpecifierSet(project["requires-python"])
    found = [
        f"Python {version}"
        for version, day in PYTHONS.items()
        if months(day, today) < 36 and not python.contains(f"{version}.0")
    ]
    for requirement in map(Requirement, project["dependencies"]):
        for version, day in CORE.get(requirement.name, {}).items():
            if months(day, today) < 24 and not requirement.specifier.contains(version):
                found.append(f"{requirement.name} {version}")
    return found


def loaded_early(module: str = "fish_env") -> list[str]:
    """SPEC 1: heavy packages that `import fish_env` loads."""
    code = f"import sys, {module}; print(*[n for n in {HEAVY!r} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.split()


def global_random(
    folders: tuple[str, ...] = ("fish_env", "agents"), root: Path = ROOT
) -> list[str]:
    """SPEC 7: places that use NumPy's global random state."""
    return [
        f"{file.relative_to(root)}:{number}"
        for folder in folders
        for file in sorted((root / folder).rglob("*.py"))
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if GLOBAL_RANDOM.search(line)
    ]


def without_rng(functions: list[Callable[..., Any]] | None = None) -> list[str]:
    """SPEC 7: functions for notebooks that take a seed under another name than `rng`."""
    if functions is None:
        import fish_env

        functions = [fish_env.compare, fish_env.fit, fish_env.diagnose]
    names = {"seed", "random_state", "random_seed"}
    return [f.__name__ for f in functions if names & set(inspect.signature(f).parameters)]


def without_docstring(file: Path = ROOT / "fish_env" / "__init__.py") -> list[str]:
    """pyOpenSci: public functions of the package that have no docstring."""
    import fish_env

    tree = ast.parse(file.read_text(encoding="utf-8"))
    [names] = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    ]
    return [name for name in names if not (getattr(fish_env, name).__doc__ or "").strip()]


def items(today: date) -> dict[str, list[str]]:
    """Item of a checklist -> what speaks against it.

    Args:
        today: Decides which versions SPEC 0 supports.
    """
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    return {
        "pyOpenSci: files of a project are there": missing_files(),
        "pyOpenSci: metadata are complete": missing_metadata(project),
        "pyOpenSci: public names have docstrings": without_docstring(),
        "pyOpenSci: types are shipped": []
        if (ROOT / "fish_env" / "py.typed").is_file()
        else ["fish_env/py.typed"],
        "SPEC 0: supported versions are admitted": refused_versions(project, today),
        "SPEC 1: heavy packages are loaded when needed": loaded_early(),
        "SPEC 7: no global random state": global_random(),
        "SPEC 7: functions take rng": without_rng(),
    }


def main() -> int:
    """Prints every item, and what speaks against it."""
    found = items(date.today())
    for item, faults in found.items():
        print(f"{'FAILS' if faults else 'holds'}  {item}", *faults, sep="\n         ")
    return int(any(found.values()))


if __name__ == "__main__":
    sys.exit(main())
