"""Looks up known vulnerabilities of requirements.lock, and says what could not be looked up.

    python -m scripts.reliability.audit

`pip-audit` ends with status 0 when it could look up nothing. This ends with 1 for a known
vulnerability, and with 2 when a package was not looked up, such as where the service cannot be
reached.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scripts.results import ROOT

LOCK = ROOT / "requirements.lock"


def verdict(report: Mapping[str, Any]) -> tuple[int, str]:
    """Exit status and words for a report of pip-audit in JSON."""
    packages = report["dependencies"]
    skipped = [each["name"] for each in packages if "skip_reason" in each]
    known = [
        f"{each['name']} {each['version']}: {fault['id']}"
        for each in packages
        for fault in each.get("vulns", ())
    ]
    if known:
        return 1, "known vulnerabilities: " + "; ".join(known)
    if skipped or not packages:
        return 2, (
            f"not audited: {len(skipped)} of {len(packages)} packages could not be looked up; "
            "run it where the vulnerability service of PyPI can be reached"
        )
    return 0, f"no known vulnerability in {len(packages)} packages"


def audit(lock: Path) -> tuple[int, str]:
    """Audits a file of requirements with hashes."""
    command = [sys.executable, "-m", "pip_audit", "--requirement", str(lock), "--disable-pip"]
    done = subprocess.run(
        [*command, "--format", "json", "--progress-spinner", "off"], capture_output=True, text=True
    )
    try:
        report = json.loads(done.stdout)
    except ValueError:
        lines = done.stderr.strip().splitlines() or ["pip-audit said nothing"]
        return 2, f"not audited: {lines[-1]}"
    return verdict(report)


if __name__ == "__main__":
    status, words = audit(LOCK)
    print(words)
    sys.exit(status)
