"""Installs the oldest and the newest supported versions, and runs tests on each.

    python -m scripts.reliability.versions                 # into results/
    python -m scripts.reliability.versions --only newest-3.11

Needs `uv` (from PyPI) and the interpreters. One that is not on this machine is left out and named.
PyTorch is always the version of constraints.txt, as others may pull gigabytes; where it is no CPU
build, `--base` leaves out the extra `train` and its tests. Kernels that were compiled
for a case stay in the folder that `--work` names.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scripts.results import RESULTS, ROOT, today, write_dated

PACKAGES = ("gymnasium", "numpy", "numba", "stable-baselines3", "pandas", "scipy", "torch")
CASES = {
    "oldest-3.11": ("3.11", "lowest-direct"),
    "newest-3.11": ("3.11", "highest"),
    "newest-3.12": ("3.12", "highest"),
    "newest-3.13": ("3.13", "highest"),
    "newest-3.14": ("3.14", "highest"),
}
"""Name -> Python and how uv resolves what pyproject.toml asks for."""
TRAIN_TESTS = ("tests/unit/test_sb3_adapter.py",)
WITHOUT_TRAIN = (
    "--deselect=tests/conformance/test_api.py::test_stable_baselines3_has_nothing_to_complain_about"
)
"""For pytest: a test of the extra `train` in a file that has others."""
TESTS = (
    "tests/conformance/test_api.py",
    "tests/conformance/test_vector.py",
    "tests/conformance/test_record.py",
    *TRAIN_TESTS,
    "tests/unit/test_data_reading.py",
    "tests/unit/test_compare_runs.py",
)
SHOW = (
    "import importlib.metadata as m, json, platform, sys;"
    "found = {d.name.replace('_', '-'): d.version for d in m.distributions()};"
    "versions = {n: found[n] for n in sys.argv[1:] if n in found};"
    "print(json.dumps({'python': platform.python_version()} | versions))"
)


def interpreter(python: str) -> str | None:
    """Path of an interpreter of this version, on the path or among those of pyenv."""
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    known = sorted(root.glob(f"{python}.*/bin/python{python}"))
    for found in [*map(str, known[::-1]), shutil.which(f"python{python}")]:
        if found and subprocess.run([found, "-V"], capture_output=True).returncode == 0:
            return found
    return None


def run(command: Sequence[str | Path], kernels: Path, **environment: str) -> tuple[bool, str]:
    """Whether a command succeeds, and the end of what it says; compiled kernels go to a folder."""
    done = subprocess.run(
        list(map(str, command)),
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "ROBOFISH_CACHE_DIR": str(kernels), **environment},
    )
    return done.returncode == 0, (done.stdout + done.stderr)[-3000:]


def tested_torch() -> str:
    """The requirement that constraints.txt has for PyTorch."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return next(line for line in lines if line.startswith("torch=="))


def try_case(name: str, place: Path, tests: Sequence[str], base: bool) -> dict[str, Any]:
    """Installs one set of versions in an environment of its own and runs the tests there."""
    python, resolution = CASES[name]
    found = interpreter(python)
    if found is None:
        return {"installed": False, "why": f"no Python {python} on this machine"}
    uv, folder = [sys.executable, "-m", "uv"], place / name
    binary = folder / "bin" / "python"
    kernels = place / f"{name}-kernels"
    begun = time.monotonic()
    wanted = [f"{ROOT}[render]"] if base else [f"{ROOT}[render,train]", tested_torch()]
    steps = (
        [*uv, "venv", "--quiet", "--clear", "--python", found, folder],
        [
            *uv, "pip", "install", "--quiet", "--python", binary, "--resolution", resolution,
            "--only-binary", ":all:", *wanted, "--no-binary", "robotic-fish",
        ],
        [*uv, "pip", "install", "--quiet", "--python", binary, "pytest>=8.3,<10", "pyarrow>=17"],
    )  # fmt: skip
    for step in steps:
        good, said = run(step, kernels)
        if not good:
            return {"installed": False, "why": said.strip().splitlines()[-12:]}
    versions = json.loads(run([binary, "-c", SHOW, *PACKAGES], kernels)[1].splitlines()[0])
    good, said = run(
        [binary, "-m", "pytest", "-p", "no:cacheprovider", *tests], kernels,
        PYTHONPATH=str(ROOT), PYTHONDONTWRITEBYTECODE="1",
    )  # fmt: skip
    failed = re.findall(r"^(?:FAILED|ERROR) .*$", said, re.MULTILINE)
    return {
        "installed": True,
        "resolution": resolution,
        "versions": versions,
        "passed": good,
        "tests": list(tests),
        "failed": failed or ([] if good else said.splitlines()[-12:]),
        "minutes": round((time.monotonic() - begun) / 60.0, 1),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.versions")
    add = parser.add_argument
    add("--only", help=f"some of {','.join(CASES)}; default: all")
    add("--base", action="store_true", help="without the extra `train` and its tests")
    add("--tests", help="other tests, separated by commas")
    add("--work", type=Path, help="folder of the environments; default: a temporary one")
    add("--out", type=Path, default=RESULTS, help="folder of the dated result")
    options = parser.parse_args(arguments)
    names = options.only.split(",") if options.only else list(CASES)
    tests = options.tests.split(",") if options.tests else TESTS
    if options.base:
        tests = [*(test for test in tests if test not in TRAIN_TESTS), WITHOUT_TRAIN]
    cases = {}
    with tempfile.TemporaryDirectory() as spare:
        for name in names:
            cases[name] = try_case(name, options.work or Path(spare), tests, options.base)
            print(f"{name}: {cases[name]}", flush=True)
    file = write_dated(options.out, "versions", {"cases": cases})
    print(f"{today()}: written: {file.name}")
    sys.exit(any(case["installed"] and not case["passed"] for case in cases.values()))


if __name__ == "__main__":
    main()
