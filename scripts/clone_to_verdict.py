"""Time from `git clone` to the first verdict: `python -m scripts.clone_to_verdict`.

Clones this repository into an empty folder and runs `make demo` there, as the README says. The
caches of pip, compiled kernels and matplotlib are empty, so everything is downloaded, built and
compiled. The seconds of each stage and the verdict go into results/clone-to-verdict-<date>.json.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scripts.bench.harness import load_average, machine
from scripts.results import RESULTS, ROOT, write_dated

STAGES = {
    "environment": "Creating .venv",
    "install": "Installing robotic-fish",
    "demo": "1 of ",
    "verdict": "The simulation lacks",
}
"""Stage -> words in the first line of it that `make demo` prints."""
TARGET_S = 300.0


class StageError(Exception):
    """`make demo` failed, or printed no verdict."""


def times(lines: Iterable[str], begun: float) -> tuple[dict[str, float], str]:
    """When each stage began.

    Args:
        lines: Output of `make demo`, as it comes.
        begun: Time of `time.monotonic` from which seconds count.

    Returns:
        Seconds of each stage, and the line with the verdict.
    """
    seconds, verdict = dict[str, float](), ""
    for line in lines:
        for stage, words in STAGES.items():
            if stage not in seconds and words in line:
                seconds[stage] = round(time.monotonic() - begun, 1)
                verdict = line.strip() if stage == "verdict" else verdict
    return seconds, verdict


def run(folder: Path, python: str) -> dict[str, Any]:
    """Clones into a folder and runs the demonstration there.

    Args:
        folder: Empty folder.
        python: Interpreter that `make` uses.

    Returns:
        Seconds of each stage since the start, and the verdict.

    Raises:
        StageError: The demonstration failed, or no verdict was printed.
    """
    clone, cache = folder / "robotic-fish", folder / "cache"
    env = {**os.environ, "XDG_CACHE_HOME": str(cache), "ROBOFISH_CACHE_DIR": str(cache / "kernels")}
    env |= {"PIP_CACHE_DIR": str(cache / "pip"), "MPLCONFIGDIR": str(cache / "matplotlib")}
    for name in ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS", "MAKELEVEL"):
        env.pop(name, None)
    begun = time.monotonic()
    subprocess.run(["git", "clone", "--quiet", "--no-local", str(ROOT), str(clone)], check=True)
    cloned = round(time.monotonic() - begun, 1)
    with subprocess.Popen(
        ["make", f"PYTHON={python}", "demo"], cwd=clone, env={**env, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        output = list[str]()

        def passed_on() -> Iterable[str]:
            for line in process.stdout or ():
                output.append(line)
                yield line

        seconds, verdict = times(passed_on(), begun)
    if process.returncode or not verdict:
        raise StageError(f"make demo: exit status {process.returncode}\n{''.join(output)}")
    end = round(time.monotonic() - begun, 1)
    return {"seconds": {"cloned": cloned, **seconds, "end": end}, "verdict": verdict}


def main() -> None:
    """Measures and writes the result."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--python", default="python3", help="interpreter for make")
    parser.add_argument("--out", type=Path, default=RESULTS)
    told = parser.parse_args()
    before = machine()
    with tempfile.TemporaryDirectory(prefix="clone-") as name:
        content = run(Path(name), told.python)
    within = content["seconds"]["verdict"] <= TARGET_S
    content |= {"target_s": TARGET_S, "met": within}
    content |= {"machine": before, "load_average_after": load_average()}
    print(content["verdict"])
    print(f"{content['seconds']} s from the start; target {TARGET_S:g} s for the verdict")
    print(write_dated(told.out, "clone-to-verdict", content))


if __name__ == "__main__":
    main()
