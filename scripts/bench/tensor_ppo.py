"""Trains `hold` with PPO over tensors on the CPU, under five seeds.

    python -m scripts.bench.tensor_ppo      # minutes; writes results/tensor-ppo-<date>.json

The recipe is that of the GPU. Whether it learns, and in how many steps, does not depend on the
device; how long it takes does, and is measured by `scripts.bench.gpu`.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from robofish_agents.training.actor_critic import HOLD, HOLD_FISH
from robofish_agents.training.host_env import HostEnv
from robofish_agents.training.tensor_ppo import success_rate, train
from scripts.bench.harness import machine, versions
from scripts.results import RESULTS, write_dated

SEEDS = range(5)
JUDGED = 512
"""Episodes that each policy is judged on, of fish that it did not train with."""


def trained(seed: int) -> dict[str, Any]:
    """One training, and how its policy does."""
    judges = HostEnv.of_fish(JUDGED)
    done = train(HostEnv.of_fish(HOLD_FISH), HOLD, seed)
    return {
        "seed": seed,
        "success_rate": success_rate(judges, done.policy, 1000 + seed),
        "control_steps": done.steps,
        "updates": done.updates,
        "seconds": done.seconds,
    }


def main(argv: list[str] | None = None) -> None:
    """Train, print, write."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.tensor_ppo")
    parser.add_argument("--dry", action="store_true", help="write nothing")
    options = parser.parse_args(argv)
    rows = []
    for seed in SEEDS:
        rows.append(trained(seed))
        print(rows[-1], flush=True)
    content = {
        "command": "python -m scripts.bench.tensor_ppo",
        "fish": HOLD_FISH,
        "recipe": asdict(HOLD),
        "machine": machine(),
        "versions": versions(("numpy", "numba", "torch")),
        "trainings": rows,
    }
    if not options.dry:
        print(f"written: {write_dated(RESULTS, 'tensor-ppo', content)}")


if __name__ == "__main__":
    main()
