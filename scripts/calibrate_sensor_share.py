"""How far the noise that quiet stretches show may lie above the true noise of sensors.

Fish swim random commands with beats up to 2.5 Hz and are recorded at several rates. What the beat
leaves in differences of neighbours counts as noise, the more so the slower the recording. The
smallest share of true over apparent noise says how far a fit may lower it.

    python scripts/calibrate_sensor_share.py --sets 6
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from rich.progress import track

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.noise import white_noise_sd
from fish_env.inference.policy import POLICY
from fish_env.simulator import Simulator
from scripts.results import RESULTS, write_dated

RATES_HZ = (10.0, 13.0, 25.0, 50.0, 100.0)
USUAL_SD = dict.fromkeys("xyz", 2e-3)
USUAL_SD |= dict.fromkeys(("roll", "pitch", "yaw"), 5e-3) | dict.fromkeys("pqr", 0.01)
RUNS, RUN_S, HELD_S = 6, 30.0, 2.5
FISH = "zheng-2021-a"


def shares(rate_hz: float, rng: np.random.Generator) -> dict[str, float]:
    """True over apparent noise of each channel, in one set of runs."""
    runs = tuple(_run(f"r{i}", rate_hz, rng) for i in range(RUNS))
    dataset = Dataset("swims", FISH, runs)
    return {name: sd / white_noise_sd(dataset, name) for name, sd in USUAL_SD.items()}


def _run(name: str, rate_hz: float, rng: np.random.Generator) -> Run:
    times = np.arange(0.0, RUN_S, HELD_S)
    low, high = [-0.5, 0.1, 0.5, -0.01, -0.6], [0.5, 0.5, 2.5, 0.01, 0.6]
    commands = CommandSteps(times, rng.uniform(low, high, (len(times), 5)))
    swim = Simulator(FISH).run(commands, duration_s=RUN_S, rate_hz=rate_hz)
    noisy = {c: swim[c] + sd * rng.standard_normal(len(swim)) for c, sd in USUAL_SD.items()}
    return Run.from_steps(name, swim.time_s, noisy, commands, start="rest")


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=6, help="of runs, at each rate")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    rng = np.random.default_rng(72000)
    rows = []
    for rate_hz in track(RATES_HZ):
        found = [shares(rate_hz, rng) for _ in range(options.sets)]
        least = {name: round(min(one[name] for one in found), 3) for name in USUAL_SD}
        rows.append({"rate_hz": rate_hz, "least": least})
    for row in rows:
        print(row["rate_hz"], row["least"])
    least = min(min(row["least"].values()) for row in rows)
    print(f"smallest share {least}; the limit is {POLICY.least_sensor_share}")
    print(write_dated(options.out, "sensor-share", {"rows": rows}))


if __name__ == "__main__":
    main()
