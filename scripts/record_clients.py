"""Writes results/clients-<date>.json from the tests of `make clients`.

Run it with the Python of the libraries: `.venv-clients/bin/python -m scripts.record_clients FILE`,
where FILE is what `pytest --junitxml=FILE tests/clients/client_*.py` wrote.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from scripts.bench.harness import machine, versions
from scripts.junit import outcomes
from scripts.results import RESULTS, write_dated

LIBRARIES = (
    "gymnasium", "stable-baselines3", "rl_zoo3", "ray", "tianshou", "torchrl", "minari", "d3rlpy",
    "torch", "numpy",
)  # fmt: skip


def counted(tests: Iterable[Mapping[str, Any]]) -> tuple[dict[str, dict[str, int]], float]:
    """How many tests of each file passed, failed or were skipped, and the seconds of all.

    Args:
        tests: see :func:`scripts.junit.outcomes`.
    """
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    seconds = 0.0
    for test in tests:
        counts[test["test"].partition("::")[0]][test["outcome"]] += 1
        seconds += test["seconds"]
    return {name: dict(counter) for name, counter in sorted(counts.items())}, round(seconds, 1)


def main() -> None:
    """Reads the report and writes the result."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("file", type=Path, help="report of pytest in JUnit's format")
    told = parser.parse_args()
    tests, seconds = counted(outcomes(told.file))
    content: dict[str, Any] = {
        "tests": tests, "seconds": seconds, "versions": versions(LIBRARIES), "machine": machine(),
        "package": metadata.version("robotic-fish"),
    }  # fmt: skip
    print(write_dated(RESULTS, "clients", content))


if __name__ == "__main__":
    main()
