"""Runs the tests on a local Ray cluster, and keeps what they found.

``python -m scripts.reliability.cluster`` needs Ray, and writes ``results/cluster-<date>.json``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from scripts.bench.harness import machine, versions
from scripts.junit import outcomes
from scripts.results import RESULTS, ROOT, write_dated

PACKAGES = ("ray", "torch", "gymnasium", "numpy")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.cluster")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the dated result")
    options = parser.parse_args(arguments)
    tests = sorted(str(file.relative_to(ROOT)) for file in ROOT.glob("tests/cluster/ray_*.py"))
    with tempfile.TemporaryDirectory() as spare:
        report = Path(spare) / "report.xml"
        command = [sys.executable, "-m", "pytest", f"--junitxml={report}", *tests]
        status = subprocess.run(command, cwd=ROOT).returncode
        if not report.exists():
            sys.exit(status)
        found = outcomes(report)
    content = {"versions": versions(PACKAGES), "machine": machine(), "tests": found}
    file = write_dated(options.out, "cluster", content)
    print(f"written: {file.name}")
    sys.exit(status)


if __name__ == "__main__":
    main()
