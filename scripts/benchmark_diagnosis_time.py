"""How the time and the memory of a diagnosis grow with the data and with the catalogue.

One experiment, with a current hidden in it, is diagnosed whole, and again with one thing changed at
a time. Every diagnosis is a process of its own with one thread; making the data does not count.
Processor time is what compares on a machine that other work shares. Each result is kept, so a
stopped run goes on where it was.

    python scripts/benchmark_diagnosis_time.py
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from scripts.one_thread import ONE_THREAD  # noqa: E402
from scripts.results import RESULTS, kept, today, write_dated  # noqa: E402

HIDDEN = {"current": {"north": 0.04, "east": -0.04, "down": 0.01}}


@dataclass(frozen=True)
class Experiment:
    """What is diagnosed.

    Attributes:
        runs: number of runs.
        seconds: length of each.
        camera: position and yaw at 15 Hz instead of nine channels at 25 Hz.
        effects: how many effects of the catalogue are considered; None: all.
        quick: the quick way.
    """

    runs: int = 8
    seconds: float = 30.0
    camera: bool = False
    effects: int | None = None
    quick: bool = False


WHOLE = Experiment()
CASES = {
    "8 runs of 30 s, 9 channels, whole catalogue": WHOLE,
    "4 runs": replace(WHOLE, runs=4),
    "16 runs": replace(WHOLE, runs=16),
    "runs of 15 s": replace(WHOLE, seconds=15.0),
    "4 channels at 15 Hz, as from a camera": replace(WHOLE, camera=True),
    "12 effects": replace(WHOLE, effects=12),
    "24 effects": replace(WHOLE, effects=24),
    "`--quick`": replace(WHOLE, quick=True),
    "runs of 60 s": replace(WHOLE, seconds=60.0),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the result")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "benchmark-time")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measured(Experiment(**json.loads(options.one)))))
        return
    rows = []
    for name, case in CASES.items():
        file = options.work / f"{'-'.join(str(value) for value in asdict(case).values())}.json"
        rows.append({"case": name, **asdict(case), **kept(file, partial(alone, case))})
        print(table(rows).splitlines()[-1], flush=True)
    write(rows, options.out)


def alone(case: Experiment) -> dict[str, Any]:
    """One diagnosis in a process of its own, so that its memory is its own."""
    command = [sys.executable, str(Path(__file__)), "--one", json.dumps(asdict(case))]
    done = subprocess.run(
        command, env={**os.environ, **ONE_THREAD}, check=True, capture_output=True, text=True
    )
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def measured(case: Experiment) -> dict[str, Any]:
    """Processor time, wall time and peak memory of one diagnosis."""
    from fish_env.diagnosis import pipeline

    everything = pipeline.causes_of
    pipeline.causes_of = lambda problem: fewer(everything(problem), case.effects)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "data"
        make(case, folder)
        wall, processor = time.perf_counter(), time.process_time()
        answer = pipeline.diagnose(folder, quick=case.quick)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "cpu_s": round(processor, 2),
        "wall_s": round(wall, 2),
        "peak_mb": round(peak / 1024.0),
        "verdict": answer["verdict"],
        "causes": [cause["name"] for cause in answer["causes"]],
    }


def make(case: Experiment, folder: Path) -> None:
    """The measurements."""
    from tests.hidden.designs import swim_design
    from tests.hidden.plans import AS_CAMERA, RICH

    plan = AS_CAMERA if case.camera else RICH
    plan = replace(plan, runs=case.runs, duration=case.seconds)
    swim_design(0, 0, folder, HIDDEN, plan=plan)


def fewer(causes: Sequence[Any], effects: int | None) -> tuple[Any, ...]:
    """All coefficients, the hidden effect, and as many others as are wanted."""
    names = sorted((c.id for c in causes if c.is_effect), key=lambda name: name not in HIDDEN)
    kept = names[:effects]
    return tuple(cause for cause in causes if not cause.is_effect or cause.id in kept)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Processor time, and how often that of the first row."""
    lines = [
        "| diagnosed | processor time (s) | of the first | wall time (s) | peak memory (MB) |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        share = row["cpu_s"] / rows[0]["cpu_s"]
        lines.append(
            f"| {row['case']} | {row['cpu_s']:.1f} | {share:.2f} | {row['wall_s']:.1f} "
            f"| {row['peak_mb']} |"
        )
    return "\n".join(lines)


def write(rows: list[dict[str, Any]], folder: Path) -> None:
    page = f"# Time of a diagnosis, {today()}\n\n{table(rows)}\n"
    write_dated(folder, "diagnosis-time", {"cases": rows}, page)
    print(page)


if __name__ == "__main__":
    main()
