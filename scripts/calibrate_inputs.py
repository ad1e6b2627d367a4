"""How often the input step finds mistakes in good data, and whether it finds those put in.

Measurements without a mistake come from every tier of hidden cases that measures runs over time:
with nothing wrong with the model, with effects of the catalogue and with others. A fault that binds
the verdict or changes the data is a false alarm, but for effects that are a wrong clock or beat
themselves. Then each mistake of a list is put into data of a few kinds of sensors. Cases are
numbered from 70000 on, so that none of them is one that a threshold was chosen by.

    python scripts/calibrate_inputs.py --cases 20
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from rich.progress import track  # noqa: E402

from fish_env.diagnosis.inputs.check import check_inputs  # noqa: E402
from fish_env.diagnosis.inputs.library import readings  # noqa: E402
from fish_env.diagnosis.inputs.search import best_reading  # noqa: E402
from fish_env.diagnosis.inputs.weighing import Scales  # noqa: E402
from fish_env.params import load_fish  # noqa: E402
from scripts.hidden_runs import hidden_runs  # noqa: E402
from scripts.results import RESULTS, write_dated  # noqa: E402
from tests.diagnosis.mistakes import SENSORS, found_by, mistakes_of, sensed  # noqa: E402
from tests.hidden.cases import make_case  # noqa: E402

FIRST = 70000
GOOD = ("null", "null_strong", "null_camera", "null_closed_loop", "null_designs")
WITH_EFFECTS = ("rich", "camera", "closed_loop", "outside", "designs")
OF_TIME = ("clock_scale", "clock_skew", "frequency_scale", "battery_sag")
"""Effects that are a wrong clock or beat."""


def good(job: tuple[str, int]) -> dict[str, Any]:
    """What the input step says of a case without a mistake."""
    tier, seed = job
    truth, dataset = hidden_runs(make_case, tier, seed)
    found = check_inputs(dataset)
    scales = Scales(load_fish(dataset.fish))
    best = best_reading(dataset, scales, scales.weigh(dataset), readings(dataset))
    acting = [*truth.effects, *truth.foreign]
    return {
        "tier": tier,
        "seed": seed,
        "effects": acting,
        "alarm": any(f.binds or f.corrected for f in found.faults)
        and not set(acting) & set(OF_TIME),
        "said": [fault.fix for fault in found.faults],
        "best_log_evidence": best.gain if best else 0.0,
    }


def spoilt(job: tuple[str, str, int]) -> dict[str, Any]:
    """Whether a mistake that is put into a case is found and named."""
    sensors, name, seed = job
    dataset = sensed(sensors, seed)
    mistake = mistakes_of(dataset)[name]
    faults = check_inputs(mistake.applied(dataset)).faults
    return {
        "sensors": sensors,
        "mistake": name,
        "seed": seed,
        "found": found_by(mistake, faults),
        "said": [[fault.fix, *fault.alternatives] for fault in faults],
    }


def page(alarms: Sequence[dict[str, Any]], finds: Sequence[dict[str, Any]]) -> str:
    """A table of each, for readers."""
    lines = ["# Input step: false alarms and mistakes found", "", "| tier | cases | false alarms |",
             "| --- | --- | --- |"]  # fmt: skip
    count, wrong = (
        Counter(r["tier"] for r in alarms),
        Counter(r["tier"] for r in alarms if r["alarm"]),
    )
    lines += [f"| {tier} | {count[tier]} | {wrong[tier]} |" for tier in count]
    lines += ["", "| sensors | mistakes | found | missed |", "| --- | --- | --- | --- |"]
    for sensors in SENSORS:
        own = [r for r in finds if r["sensors"] == sensors]
        missed = ", ".join(r["mistake"] for r in own if not r["found"]) or "none"
        lines.append(f"| {sensors} | {len(own)} | {sum(r['found'] for r in own)} | {missed} |")
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20, help="of each tier")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    jobs = [(t, FIRST + i) for t in (*GOOD, *WITH_EFFECTS) for i in range(options.cases)]
    put_in = [
        (sensors, name, FIRST)
        for sensors in SENSORS
        for name in mistakes_of(sensed(sensors, FIRST))
    ]
    with ProcessPoolExecutor(options.processes) as pool:
        alarms = list(track(pool.map(good, jobs), "good data", total=len(jobs)))
        finds = list(track(pool.map(spoilt, put_in), "mistakes", total=len(put_in)))
    text = page(alarms, finds)
    content = {"first_seed": FIRST, "good": alarms, "mistakes": finds}
    write_dated(options.out, "inputs", content, text)
    print(text)


if __name__ == "__main__":
    main()
