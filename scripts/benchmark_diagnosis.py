"""Runs a suite of hidden effects and writes its rates and answers to a dated file.

Each finished case is kept, so a stopped run goes on where it was. Its result takes the place of one
of the same day; what `--finished` sums up is written beside it:

    python scripts/benchmark_diagnosis.py --tiers rich,null --limit 20
    python scripts/benchmark_diagnosis.py --suite realistic
    python scripts/benchmark_diagnosis.py --seed0 20000 --after results/parts/FILE
    python scripts/benchmark_diagnosis.py --suite realistic --ray --address auto

With `--ray` the cases are tasks of a Ray cluster, and only this process writes.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from rich.progress import track  # noqa: E402

from fish_env.cluster import ClusterSettings, Failed, Task, connected, run_tasks  # noqa: E402
from scripts.results import RESULTS, commit, kept, today, write_dated  # noqa: E402
from tests.hidden.suite import PIPELINE, SUITES, Job, do, jobs, keep, make  # noqa: E402


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    suite = SUITES[options.suite]
    root = options.work or ROOT / "out" / f"benchmark-{suite.result}"
    work = root / ("quick" if options.quick else "full")
    work.mkdir(parents=True, exist_ok=True)
    chosen = options.tiers or tuple(suite.counts)
    todo = jobs(work, chosen, options.limit, options.seed0, options.diagnose, options.quick)
    if options.fresh:
        for job in todo:
            job.file.unlink(missing_ok=True)
    if options.after:
        take_over(options.after, todo)
    if options.finished:
        todo = [job for job in todo if job.file.exists()]
    lost: list[str] = []
    found = on_ray(todo, options, lost.append) if options.ray else run(todo, options.processes)
    finished = track(found, f"{len(todo)} cases", total=len(todo))
    rows = sorted(finished, key=lambda row: (row.tier, row.seed))
    if lost:
        sys.exit("not finished, run the same command again:\n" + "\n".join(lost))
    write(rows, options)


def take_over(result: Path, todo: list[Job]) -> None:
    """Keep the cases of an earlier part of this run as finished ones.

    Args:
        result: what that part was summed up in.
        todo: all cases of the run.
    """
    part = json.loads(result.read_text(encoding="utf-8"))
    if part["commit"] != commit():
        sys.exit(f"{result}: made at {part['commit']}, and this is {commit()}; check that out")
    rows = {(row["tier"], row["seed"]): row for row in part["rows"]}
    for job in todo:
        if row := rows.get((job.tier, job.seed)):
            kept(job.file, partial(dict, row=row))


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--suite", choices=SUITES, default="catalogue")
    add("--tiers", help="some tiers of the suite, separated by commas; default: all")
    add("--limit", type=int, help="at most this many cases")
    add("--seed0", type=int, default=0, help="number of the first case of each tier")
    add("--quick", action="store_true", help="let the diagnosis take its quick way")
    add("--finished", action="store_true", help="only sum up the cases finished so far")
    add("--after", type=Path, help="result of an earlier part of this run, which goes on after it")
    add("--fresh", action="store_true", help="do finished cases again")
    add("--processes", type=int, default=2)
    add("--ray", action="store_true", help="run the cases as Ray tasks, see docs/cluster.md")
    add("--address", help="with --ray: a running cluster, HOST:PORT or auto")
    add("--temp", type=Path, help="with --ray: folder for Ray's own files on this machine")
    add("--work", type=Path, help="folder of finished cases; default: out/benchmark-...")
    add("--out", type=Path, default=RESULTS, help="folder of the dated result")
    add("--diagnose", default=PIPELINE, help="module:function to judge instead")
    options = parser.parse_args(arguments)
    if not options.ray and (options.address or options.temp):
        parser.error("--address and --temp belong to --ray")
    options.tiers = tuple(options.tiers.split(",")) if options.tiers else ()
    known = SUITES[options.suite].counts
    if unknown := set(options.tiers) - set(known):
        parser.error(
            f"--tiers: suite {options.suite} has no tier {', '.join(sorted(unknown))}; "
            f"use some of {', '.join(known)}"
        )
    return options


def run(todo: list[Job], processes: int) -> Iterator[Any]:
    if processes == 1:
        yield from map(do, todo)
        return
    with ProcessPoolExecutor(processes) as pool:
        for future in as_completed([pool.submit(do, job) for job in todo]):
            yield future.result()


def on_ray(
    todo: list[Job], options: argparse.Namespace, lose: Callable[[str], object]
) -> Iterator[Any]:
    """The rows of the jobs as Ray's tasks end; told the cases whose processes died each time."""
    left = [job for job in todo if not job.file.exists()]
    yield from (do(job) for job in todo if job not in left)
    if not left:
        return
    cpus = None if options.address else options.processes
    with connected(ClusterSettings(options.address, cpus, options.temp)) as ray:
        for task, result in run_tasks(ray, make, (Task(job.file.stem, job) for job in left)):
            if isinstance(result, Failed):
                lose(f"{task.name}: {result.reason}")
            else:
                yield keep(task.payload, lambda found=result: found)


def write(rows: list[Any], options: argparse.Namespace) -> None:
    suite, seed0 = SUITES[options.suite], options.seed0
    summary = suite.summarise(rows)
    said = f"{len(rows)} cases, numbered from {seed0} in each tier, diagnosed at {commit()}."
    page = suite.page(today(), said, summary)
    content = {"seed0": seed0, **summary, "rows": [asdict(row) for row in rows]}
    kind = f"{suite.result}-quick" if options.quick else suite.result
    write_dated(options.out, kind, content, page, beside=options.finished)
    print(page)


if __name__ == "__main__":
    main()
