"""Long runs: steps of the native batch, then train, evaluate and diagnose in turn.

    python -m scripts.reliability.soak                # 1e8 steps, then eight hours
    python -m scripts.reliability.soak --only batch --steps 1e6
    python -m scripts.reliability.soak --only turns --hours 0.25

What grows after the warm-up (memory, open files, threads, files left) ends it with status 1. Each
part writes a dated file into results/.
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
from scripts.reliability import watch
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
    add("--seed", type=int, default=0)
    add("--out", type=Path, default=RESULTS, help="folder of the dated results")
    return parser.parse_args(arguments)


def batch(options: argparse.Namespace) -> dict[str, Any]:
    """Steps the batch and looks at what the process holds after each round."""
    from scripts.reliability.soak_batch import soak

    begun, samples = time.monotonic(), []

    def look(done: int) -> bool:
        taken = time.monotonic() - begun
        samples.append(watch.sample(taken))
        print(f"{done:>13,} steps, {taken:7.0f} s, {samples[-1].memory_mb:.0f} MB", flush=True)
        return options.most_hours is None or taken < options.most_hours * 3600.0

    result = soak(int(options.steps), options.envs, options.seed, options.threads, look)
    return result | {"resources": watch.summary(samples)}


def turns(options: argparse.Namespace) -> dict[str, Any]:
    """Trains, evaluates and diagnoses by turns until the hours are over."""
    from scripts.reliability.turns import take_turns

    with tempfile.TemporaryDirectory() as place:
        return take_turns(Path(place), options.hours * 3600.0, options.seed, print)


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    parts: dict[str, Callable[[argparse.Namespace], dict[str, Any]]]
    parts = {"batch": batch, "turns": turns}
    grew = []
    for name in [options.only] if options.only else PARTS:
        result = parts[name](options)
        file = write_dated(options.out, f"soak-{name}", {"machine": harness.machine(), **result})
        found = result["resources"]["grew"]
        print(f"{name}: {', '.join(found) or 'nothing grew'}; written: {file.name}")
        grew += found
    sys.exit(1 if grew else 0)


if __name__ == "__main__":
    main()
