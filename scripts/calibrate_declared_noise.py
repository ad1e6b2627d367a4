"""How much noise samples show over the true one, where sensors are as declared and where not.

Cases of the tiers with one cause or none have the declared noise all along; in the realistic tier
sensors are noisier while the fish moves. Of each case the median over channels is kept, of the
noise that samples show over the true noise of a fish at rest. Cases are numbered from 71000 on.

    python scripts/calibrate_declared_noise.py --cases 6
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

import numpy as np  # noqa: E402
from rich.progress import track  # noqa: E402

from fish_env.identification.sensors import noise_over_declared, without_outliers  # noqa: E402
from fish_env.inference.policy import POLICY  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from scripts.results import RESULTS, write_dated  # noqa: E402
from tests.hidden import cases as quiet  # noqa: E402
from tests.hidden.realistic import cases as moving  # noqa: E402

FIRST = 71000
STEADY = ("null", "rich", "small", "camera", "closed_loop", "outside", "designs")
NOISIER = ("realistic",)


def measured(tier: str, seed: int) -> dict[str, Any]:
    """The median of one case, and how much noisier its sensors are while the fish moves."""
    make = moving.make_case if tier in NOISIER else quiet.make_case
    truth, dataset = hidden_runs(make, tier, seed)
    known = {name: sd for name, sd in truth.noise.items() if name in dataset.channels}
    clean, _ = without_outliers(replace(dataset, noise=known))
    factor = getattr(truth, "dirt", {}).get("moving_noise", {}).get("factor", 1.0)
    median = noise_over_declared(clean)
    return {"tier": tier, "seed": seed, "factor": round(factor, 3), "median": round(median, 4)}


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=6, help="of each tier")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    jobs = [(t, FIRST + i) for i in range(options.cases) for t in (*STEADY, *NOISIER)]
    rows = [measured(*job) for job in track(jobs)]
    for name, tiers in (("as declared", STEADY), ("noisier", NOISIER)):
        own = [row["median"] for row in rows if row["tier"] in tiers]
        above = sum(median > POLICY.noisier_than_declared for median in own)
        low, high = np.quantile(own, [0.0, 1.0])
        print(f"{name}: {above} of {len(own)} above the limit, medians {low:.2f} to {high:.2f}")
    print(write_dated(options.out, "declared-noise", {"rows": rows}))


if __name__ == "__main__":
    main()
