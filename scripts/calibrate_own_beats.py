"""How clearly runs' own beats show where they differ, and where they do not.

Sets of runs with one beat come from tiers of hidden cases with one cause or none; sets whose beats
differ as those of servos do from the realistic tier. Of each run whose own beat is another the
share is kept that it takes away of what the common beat leaves. Cases are numbered from 70000 on.

    python scripts/calibrate_own_beats.py --cases 5
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from rich.progress import track  # noqa: E402

from fish_env.diagnosis.inputs.check import check_inputs  # noqa: E402
from fish_env.identification.own_beats import own_beats  # noqa: E402
from fish_env.identification.policy import IDENTIFICATION  # noqa: E402
from fish_env.identification.series import SeriesProblem  # noqa: E402
from fish_env.identification.tail_drive import tail_drive  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from scripts.results import RESULTS, write_dated  # noqa: E402
from tests.hidden import cases as one_beat  # noqa: E402
from tests.hidden.realistic import cases as own_beat  # noqa: E402

FIRST = 70000
STEP_S = 0.02
ALIKE = ("null", "rich", "camera", "closed_loop", "outside", "designs")
DIFFERENT = ("realistic",)


def measured(tier: str, seed: int) -> dict[str, Any]:
    """Gains of the runs of one case."""
    make = own_beat.make_case if tier in DIFFERENT else one_beat.make_case
    truth, dataset = hidden_runs(make, tier, seed)
    inputs = check_inputs(dataset)
    problem = SeriesProblem(inputs.dataset, None, dt=STEP_S)
    beats = own_beats(problem.with_drive(tail_drive(inputs.drive, inputs.drive_certain)))
    gains = {run: round(gain, 4) for run, gain in beats.gains.items()}
    return {"tier": tier, "seed": seed, "hidden": truth.label, "gains": gains}


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=5, help="of each tier")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    jobs = [(t, FIRST + i) for i in range(options.cases) for t in (*ALIKE, *DIFFERENT)]
    rows = [measured(*job) for job in track(jobs)]
    clearly, noticeable = IDENTIFICATION.clear_own_beat, IDENTIFICATION.noticeable_own_beat
    fewest = IDENTIFICATION.fewest_own_beats
    for name, tiers in (("one beat", ALIKE), ("own beats", DIFFERENT)):
        own = [row for row in rows if row["tier"] in tiers]
        clear = sum(max(row["gains"].values(), default=0.0) > clearly for row in own)
        several = sum(
            sum(gain > noticeable for gain in row["gains"].values()) >= fewest for row in own
        )
        print(f"{name}: {clear} of {len(own)} sets have a run above {clearly}")
        print(f"{name}: {several} of {len(own)} sets have {fewest} runs above {noticeable}")
    print(write_dated(options.out, "own-beats", {"clearly": clearly, "rows": rows}))


if __name__ == "__main__":
    main()
