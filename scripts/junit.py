"""What pytest writes of its tests in JUnit's format."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree


def outcomes(report: Path) -> list[dict[str, Any]]:
    """Name, outcome and duration of each test of a report.

    Args:
        report: of pytest in JUnit's format.
    """
    found = []
    for case in ElementTree.parse(report).iter("testcase"):
        bad = [part.tag for part in case if part.tag in ("failure", "error", "skipped")]
        name = f"{case.attrib['classname'].rpartition('.')[2]}::{case.attrib['name']}"
        seconds = round(float(case.attrib["time"]), 2)
        found.append({"test": name, "outcome": (bad or ["passed"])[0], "seconds": seconds})
    return found
