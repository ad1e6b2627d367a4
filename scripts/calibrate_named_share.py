"""What share of the misfit a main effect makes up, at most in any channel, by the hidden truth.

A diagnosis does not name a cause that makes up less than a share of the misfit beside larger ones
(`least_named_share`). Main effects of the realistic suite are to be named at 0.6 of their size, so
their shares bound it from above. No diagnosis is made. Cases are numbered from 90001 on; finished
ones are kept.

    python scripts/calibrate_named_share.py --cases 23
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from rich.progress import track  # noqa: E402

from fish_env.inference.policy import POLICY  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from scripts.results import RESULTS, kept, write_dated  # noqa: E402
from tests.hidden.realistic.cases import make_case  # noqa: E402

FIRST, TIER = 90001, "realistic_60"


def measured(seed: int) -> dict[str, Any]:
    """Main effect of a case, and its largest share in a channel."""
    truth, _ = hidden_runs(make_case, TIER, seed)
    (main,) = truth.main
    return {"seed": seed, "main": main, "most": max(truth.budget[main].values())}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--cases", type=int, default=23, help="how many")
    add("--work", type=Path, default=ROOT / "out" / "named-share", help="folder of finished cases")
    add("--out", type=Path, default=RESULTS, help="folder of the dated result")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rows = [
        kept(options.work / f"{seed}.json", partial(measured, seed))
        for seed in track(range(FIRST, FIRST + options.cases), "cases")
    ]
    rows.sort(key=lambda row: float(row["most"]))
    few = sum(row["most"] < POLICY.least_named_share for row in rows)
    result = {"tier": TIER, "limit": POLICY.least_named_share, "below": few, "cases": rows}
    print(f"{few} of {len(rows)} below; smallest:", *rows[:6], sep="\n")
    print(write_dated(options.out, "named-share", result))


if __name__ == "__main__":
    main()
