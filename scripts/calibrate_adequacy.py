"""How far chance carries the adequacy test when the disturbance is not of the kind it assumes.

The filter takes a disturbance to forget exponentially. Gusts, swell and 1/f noise leave colour in
its residuals, and a test that counts on white ones then asks for forces that are not there. For
made-up measurements without any effect, under disturbances of four colours, the smallest p-value
is set against the threshold for white residuals, which `fish_env/inference/adequacy.py` uses as it
is: it would have to be multiplied by a high quantile of their ratio, were that above one. Cases are
numbered from 1000 on, so that none of them is one that judges.

    python scripts/calibrate_adequacy.py --cases 60
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

import numpy as np  # noqa: E402
from rich.progress import track  # noqa: E402

from fish_env.identification.series import SeriesProblem  # noqa: E402
from fish_env.inference.adequacy import strongest_alarms  # noqa: E402
from fish_env.inference.estimate.fit import fit  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from scripts.results import RESULTS, write_dated  # noqa: E402
from tests.hidden.cases import make_case  # noqa: E402

FIRST = 1000
LEVELS = (0.8, 0.9, 0.95, 0.98)
KINDS = ("ratio", "changing")
"""Of forces of one size, and of those whose size comes and goes."""


def ratio(seed: int) -> dict[str, object]:
    """Smallest log p-values of a case over the threshold for white residuals."""
    truth, dataset = hidden_runs(make_case, "null_strong", seed)
    fitted = fit(SeriesProblem(dataset, None, dataset.ids[:6]), rounds=2)
    steady, changing, threshold = strongest_alarms(fitted, np.random.default_rng(seed))
    ratios = {"ratio": steady / threshold, "changing": changing / threshold}
    return {"seed": seed, **truth.disturbance, **ratios}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    with ProcessPoolExecutor(options.processes) as pool:
        jobs = pool.map(ratio, range(FIRST, FIRST + options.cases))
        rows = list(track(jobs, f"{options.cases} cases", total=options.cases))
    ratios = {kind: np.array([row[kind] for row in rows], float) for kind in KINDS}
    quantiles = {
        kind: {str(level): float(np.quantile(values, level)) for level in LEVELS}
        for kind, values in ratios.items()
    }
    write_dated(options.out, "adequacy", {"quantiles": quantiles, "cases": rows})
    for kind, values in quantiles.items():
        print(kind, ", ".join(f"{level}: {value:.2f}" for level, value in values.items()))


if __name__ == "__main__":
    main()
