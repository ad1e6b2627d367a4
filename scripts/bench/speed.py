"""Environment steps per second, beside other simulators of swimming and flying robots.

    python -m scripts.bench.speed            # some minutes; writes scripts/bench/results/
    python -m scripts.bench.speed --quick    # a look; writes nothing

Every contender takes random actions drawn beforehand and restarts the episodes that end. All run
in one process and in turn, so that other work on the machine slows all of them alike. Peers come
with ``pip install ".[bench]"``; one that is not installed is listed as missing.
"""

from __future__ import annotations

import argparse
import datetime
import json
import sys
from pathlib import Path

from scripts.bench import harness, ours, peers, report

RESULTS = Path(__file__).with_name("results")


def arguments(argv: list[str] | None = None) -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m scripts.bench.speed",
        description=(__doc__ or "").partition("\n")[0],
    )
    parser.add_argument("--quick", action="store_true", help="short timings, nothing written")
    parser.add_argument("--rounds", type=int, help="timings of each contender (default 15)")
    parser.add_argument("--only", default="", help="contenders with this text in their name")
    parser.add_argument("--out", type=Path, help=f"folder for the results (default {RESULTS})")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> None:
    """Measure, print, judge, write."""
    options = arguments(argv)
    started = datetime.datetime.now()
    before = harness.load_average()
    chosen = [b for b in (*ours.BUILDERS, *peers.BUILDERS) if options.only.lower() in b[0].lower()]
    if not chosen:
        sys.exit(f"no contender has '{options.only}' in its name")
    contenders, missing = harness.build(chosen)
    rounds = options.rounds or (3 if options.quick else 15)
    measured = harness.measure(
        contenders,
        rounds,
        0.1 if options.quick else 0.4,
        lambda turn: print(f"\rround {turn + 1} of {rounds}", end="", file=sys.stderr, flush=True),
    )
    print(file=sys.stderr)
    facts: dict[str, object] = {
        "date": started.date().isoformat(),
        "machine": {**harness.machine(), "load_average_before": before},
        "versions": harness.versions(),
        "rounds": rounds,
    }
    page = report.markdown(measured, missing, facts)
    print(page)
    folder = options.out or (None if options.quick else RESULTS)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        stem = folder / f"speed-{facts['date']}"
        stem.with_suffix(".md").write_text(page)
        numbers = json.dumps(report.record(measured, missing, facts), indent=1)
        stem.with_suffix(".json").write_text(numbers + "\n")
        print(f"written: {stem}.md and .json")


if __name__ == "__main__":
    main()
