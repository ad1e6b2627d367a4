"""Long runs: steps of the native batch, then train, evaluate and diagnose in turn.

    python -m scripts.reliability.soak                # 1e8 steps, then eight hours
    python -m scripts.reliability.soak --only batch --steps 1e6
    python -m scripts.reliability.soak --only turns --hours 0.25
    python -m scripts.reliability.soak --sum          # what all runs so far come to

What grows after the warm-up (memory, open files, threads, files left) ends it with status 1. Each
part writes a dated file into results/. Ctrl-C or SIGTERM ends a part after the present round, with
a result of what it reached. The next run draws other numbers.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from scripts.bench import harness
from scripts.reliability import soak_runs, watch
from scripts.results import RESULTS, write_dated

PARTS = ("batch", "turns")


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.soak")
    add = parser.add_argument
    add("--only", choices=PARTS, help="one of the two parts; default: both")
    add("--steps", type=float, default=1e8, help="of the batch; default: 1e8")
    add("--envs", type=int, default=1024, help="fish in the batch")
    add("--threads", type=int, help="of the batch; default: all cores")
    add("--hours", type=float, default=8.0, help="of train, evaluate and diagnose; default: 8")
    add("--most-hours", type=float, help="end the batch after so long, with what it reached")
    add("--seed", type=int, help="default: the number of earlier results")
    add("--sum", action="store_true", help="run nothing; add up the results in the folder")
    add("--out", type=Path, default=RESULTS, help="folder of the dated results")
    return parser.parse_args(arguments)


def batch(options: argparse.Namespace, stopped: Callable[[], bool]) -> dict[str, Any]:
    """Steps the batch and looks at what the process holds after each round."""
    from scripts.reliability.soak_batch import soak

    begun, samples = time.monotonic(), []

    def look(done: int) -> bool:
        taken = time.monotonic() - begun
        samples.append(watch.sample(taken))
        print(f"{done:>13,} steps, {taken:7.0f} s, {samples[-1].memory_mb:.0f} MB", flush=True)
        late = options.most_hours is not None and taken >= options.most_hours * 3600.0
        return not (late or stopped())

    result = soak(int(options.steps), options.envs, options.seed, options.threads, look)
    return result | {"resources": watch.summary(samples)}


def turns(options: argparse.Namespace, stopped: Callable[[], bool]) -> dict[str, Any]:
    """Trains, evaluates and diagnoses by turns until the hours are over."""
    from scripts.reliability.turns import take_turns

    with tempfile.TemporaryDirectory() as place:
        seconds = options.hours * 3600.0
        return take_turns(Path(place), seconds, options.seed, print, stopped=stopped)


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    names = [options.only] if options.only else PARTS
    if options.sum:
        print("\n".join(line for name in names for line in soak_runs.added_up(name, options.out)))
        return
    parts: dict[str, Callable[[argparse.Namespace, Callable[[], bool]], dict[str, Any]]]
    parts, given = {"batch": batch, "turns": turns}, options.seed
    grew = []
    with soak_runs.until_stopped() as stopped:
        for name in names:
            earlier = len(soak_runs.results_of(name, options.out))
            options.seed = earlier if given is None else given
            content = {"machine": harness.machine(), "seed": options.seed}
            content |= parts[name](options, stopped)
            file = write_dated(options.out, f"soak-{name}", content, beside=True)
            found = content["resources"]["grew"]
            print(f"{name}: {', '.join(found) or 'nothing grew'}; written: {file.name}")
            grew += found
            if stopped():
                break
    sys.exit(1 if grew else 0)


if __name__ == "__main__":
    main()
