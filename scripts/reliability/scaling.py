"""Measures what a campaign's tasks cost, and simulates a campaign on many cores with it.

    python -m scripts.reliability.scaling measure   # needs Ray; into results/scaling-<date>.json
    python -m scripts.reliability.scaling simulate results/scaling-<date>.json

The simulation is of discrete events: one process reads data, hands tasks out and writes results,
one after the other; each core works through what it gets, and compiles first.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

from scripts.one_thread import ONE_THREAD

os.environ.update(ONE_THREAD)

from fish_env.campaign import Options, find_cases, run_campaign
from fish_env.campaign.cases import diagnosed, prepare
from fish_env.cluster import ClusterSettings, Task, connected, run_tasks
from fish_env.data import load_dataset, write_dataset
from fish_env.files import write_bytes
from scripts.bench import harness
from scripts.results import RESULTS, write_dated

CORES = (1, 2, 16, 128, 1000)
EMPTY = 300
DATA = "demo-trials"
LONGER = 10.0
"""Also simulated: tasks that take so many times as long."""


@dataclass(frozen=True)
class Costs:
    """What a task costs (processor seconds and bytes).

    Attributes:
        task_s: the diagnosis, on a core with compiled kernels.
        prepare_s: reading the data and the fish, by the one process.
        hand_out_s: one empty task, there and back, by the one process.
        keep_s: writing the files of a result, by the one process.
        task_bytes: of a task, by Ray's serializer.
        result_bytes: of a result.
        compile_s: kernels of one process on a machine without a cache.
        bytes_per_s: of the network of the one process.
        start_s: of a worker process, with its imports.
    """

    task_s: float
    prepare_s: float
    hand_out_s: float
    keep_s: float
    task_bytes: int
    result_bytes: int
    compile_s: float
    bytes_per_s: float = 1.25e8
    start_s: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """What came of a simulated campaign.

    Attributes:
        wall_s: from its start to its last result.
        efficiency: seconds of diagnoses over wall-clock seconds of all cores.
        driver: share of the time in which the one process was busy.
    """

    wall_s: float
    efficiency: float
    driver: float


def simulate(costs: Costs, cores: int, tasks: int, cached: bool = False) -> Outcome:
    """A campaign of equal tasks.

    Args:
        costs: of one task.
        cores: of the cluster; each machine is new to the package.
        tasks: how many.
        cached: the machines have compiled before.

    Returns:
        Times of the whole.
    """
    first = costs.start_s + (0.0 if cached else costs.compile_s)
    before = costs.prepare_s + costs.hand_out_s + costs.task_bytes / costs.bytes_per_s
    after = costs.keep_s + costs.result_bytes / costs.bytes_per_s
    idle: list[float] = [0.0] * cores  # when each free core became free
    running: list[float] = []
    fresh, driver, busy, left, last = cores, 0.0, 0.0, tasks, 0.0
    while left or running:
        if left and idle and not (running and running[0] <= driver):
            start = max(driver, heapq.heappop(idle))
            driver, busy, left = start + before, busy + before, left - 1
            extra, fresh = (first, fresh - 1) if fresh else (0.0, 0)
            heapq.heappush(running, driver + extra + costs.task_s)
        else:
            end = heapq.heappop(running)
            heapq.heappush(idle, end)
            driver, busy = max(driver, end) + after, busy + after
            last = driver
    return Outcome(last, tasks * costs.task_s / (cores * last), busy / last)


def table(costs: Costs, per_core: int = 10) -> str:
    """The simulated campaigns as a table in Markdown."""
    lines = [
        "| cores | task, s | efficiency, empty caches | with caches | the one process is busy |",
        "| --: | --: | --: | --: | --: |",
    ]
    for factor in (1.0, LONGER):
        scaled = replace(costs, task_s=factor * costs.task_s)
        for cores in CORES:
            cold, warm = (
                simulate(scaled, cores, per_core * cores, known) for known in (False, True)
            )
            lines.append(
                f"| {cores} | {scaled.task_s:.3g} | {100 * cold.efficiency:.0f} % "
                f"| {100 * warm.efficiency:.0f} % | {100 * warm.driver:.0f} % |"
            )
    return "\n".join(lines)


def nothing(payload: bytes) -> bytes:
    """An empty task."""
    return payload


def _timed(action: Any, rounds: int) -> float:
    taken = []
    for _ in range(rounds):
        begun = time.process_time()
        action()
        taken.append(time.process_time() - begun)
    return float(median(taken))


def _child_s(cache: Path) -> float:
    """Processor seconds of a process that makes one quick diagnosis."""
    code = f"from fish_env.diagnosis import diagnose; diagnose({DATA!r}, quick=True)"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "ROBOFISH_CACHE_DIR": str(cache)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def costs_here(place: Path, cold: bool) -> tuple[Costs, dict[str, Any]]:
    """Measures, in processor time, which a busy machine changes little."""
    import ray

    (case,), options = find_cases([DATA]), Options(quick=True)
    out = place / "out"
    payload = prepare(case, options, out)
    result = diagnosed(payload)
    task_s = _timed(lambda: diagnosed(payload), 3)

    def keep() -> None:
        for name, content in result.files.items():
            write_bytes(out / name, content)

    extra: dict[str, Any] = {}
    compile_s = start_s = 0.0
    if cold:
        cache = place / "cache"
        first, again = _child_s(cache), _child_s(cache)
        compile_s, start_s = first - again, max(0.0, again - task_s)
        files = [file for file in cache.rglob("*") if file.is_file()]
        extra = {"cache_bytes": sum(f.stat().st_size for f in files), "cache_files": len(files)}
    with connected(ClusterSettings(cpus=2)) as connection:
        todo = [Task(str(i), b"") for i in range(EMPTY)]
        list(run_tasks(connection, nothing, todo[:20]))
        begun, wall = time.process_time(), time.perf_counter()
        list(run_tasks(connection, nothing, todo))
        hand_out = (time.process_time() - begun) / EMPTY
        extra["empty_task_wall_s"] = (time.perf_counter() - wall) / EMPTY
    return Costs(
        task_s, _timed(lambda: prepare(case, options, out), 5), hand_out, _timed(keep, 5),
        len(ray.cloudpickle.dumps(payload)), len(ray.cloudpickle.dumps(result)), compile_s,
        start_s=start_s,
    ), extra  # fmt: skip


def speed_up(place: Path, rounds: int, count: int) -> list[dict[str, float]]:
    """Seconds of the same campaign on one core and on two, in turn."""
    for i in range(count):
        write_dataset(load_dataset(DATA), place / "data" / f"trial-{i}")
    cases, rows = find_cases([str(place / "data")]), []
    for number in range(rounds):
        row = {}
        for cpus in (1, 2):
            with connected(ClusterSettings(cpus=cpus)) as ray:
                warm = [Task(str(i), b"") for i in range(4 * cpus)]
                list(run_tasks(ray, nothing, warm))
                begun = time.perf_counter()
                out = place / f"out-{number}-{cpus}"
                run_campaign(cases, out, Options(quick=True), ClusterSettings())
                row[f"cores_{cpus}_s"] = time.perf_counter() - begun
        rows.append({**row, "load": os.getloadavg()[0]})
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.scaling")
    parts = parser.add_subparsers(dest="part", required=True)
    measure = parts.add_parser("measure")
    measure.add_argument("--rounds", type=int, default=3, help="campaigns on one and two cores")
    measure.add_argument("--count", type=int, default=6, help="data sets in each")
    measure.add_argument("--warm", action="store_true", help="leave out the empty kernel cache")
    measure.add_argument("--out", type=Path, default=RESULTS)
    again = parts.add_parser("simulate")
    again.add_argument("result", type=Path)
    again.add_argument("--compile-s", type=float, help="in place of what was measured")
    options = parser.parse_args(arguments)
    if options.part == "simulate":
        content = json.loads(options.result.read_text(encoding="utf-8"))
        costs = Costs(**content["costs"])
        if options.compile_s is not None:
            costs = replace(costs, compile_s=options.compile_s)
        print(table(costs))
        return
    with tempfile.TemporaryDirectory() as place:
        costs, extra = costs_here(Path(place), not options.warm)
        rows = speed_up(Path(place), options.rounds, options.count) if options.rounds else []
    content = {
        "machine": harness.machine(), "costs": asdict(costs), **extra, "campaigns": rows,
        "data_sets": options.count,
    }  # fmt: skip
    print(json.dumps(content, indent=1))
    print(table(costs))
    write_dated(options.out, "scaling", content)


if __name__ == "__main__":
    main()
