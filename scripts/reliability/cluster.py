"""Runs the tests on a local Ray cluster, and keeps what they found.

``python -m scripts.reliability.cluster`` needs Ray, and writes ``results/cluster-<date>.json``.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import platform
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scripts.results import RESULTS, ROOT, write_dated

PACKAGES = ("ray", "torch", "gymnasium", "numpy")


def outcomes(report: Path) -> list[dict[str, Any]]:
    """Name, outcome and duration of each test in a JUnit report that pytest wrote."""
    found = []
    for case in xml.parse(report).iter("testcase"):
        bad = [part.tag for part in case if part.tag in ("failure", "error", "skipped")]
        name = f"{case.attrib['classname'].rpartition('.')[2]}::{case.attrib['name']}"
        seconds = round(float(case.attrib["time"]), 2)
        found.append({"test": name, "outcome": (bad or ["passed"])[0], "seconds": seconds})
    return found


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
    versions = {name: importlib.metadata.version(name) for name in PACKAGES}
    content = {"versions": {"python": platform.python_version()} | versions, "tests": found}
    file = write_dated(options.out, "cluster", content)
    print(f"written: {file.name}")
    sys.exit(status)


if __name__ == "__main__":
    main()
