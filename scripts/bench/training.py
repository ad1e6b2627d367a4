"""Times trainings of the task `hold` by recipe, and judges their policies.

    python -m scripts.bench.training ppo sac
    python -m scripts.bench.training ppo --sbx PYTHON    # with SBX, by a Python that has it
    python -m scripts.bench.training --write             # the table, into results/

Each recipe is a shipped configuration with some keys changed. All are trained under a seed before
the next seed begins, so a machine that is slow for a while is so for all. What is finished is kept
in --out and not done again; two processes may fill the same folder with different recipes. A policy
is the best of the evaluations during training. It is judged on episodes that neither
trainings, evaluations, tuning nor suites use. Times are those of training without evaluations.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from robofish_agents.evaluation.metrics import METRICS
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import RESERVED_SEEDS, Suite
from robofish_agents.policies.pretrained import PretrainedPolicy
from robofish_agents.registry import Agent
from robofish_agents.sweep.plan import plan
from robofish_agents.training.books import Quiet
from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.run import train
from scripts.bench.harness import machine, versions
from scripts.results import RESULTS, ROOT, kept, write_dated

GOAL = 0.95
JUDGED_FROM, JUDGED = 21_000_000, 500
"""First seed and number of the episodes that judge."""
assert JUDGED_FROM not in RESERVED_SEEDS
PLAIN = (
    "settings.reward.margins.depth=0.10",
    "settings.reward.margins.heading=0.20",
    "settings.reward.margins.speed=0.04",
)
"""Margins of the reward as in the environment."""
FORMER_PPO = (
    *PLAIN, "total_steps=500000", "num_envs=64", "ppo.n_steps=64", "ppo.n_epochs=6",
    "ppo.learning_rate.start=6.0e-4",
)  # fmt: skip
FEWER = (
    "num_envs=64", "sac.batch_size=512", "sac.tau=0.02", "sac.learning_rate.start=2.0e-3",
    "sac.learning_rate.end=0.0",
)  # fmt: skip


class Recipe(NamedTuple):
    """A configuration, changes of it, and the library that learns."""

    config: str
    changes: tuple[str, ...] = ()
    library: str = "sb3"


RECIPES = {
    "ppo": {
        "shipped": Recipe("ppo-hold"),
        "with the reward of the environment": Recipe("ppo-hold", PLAIN),
        "batches of 4096, twice the epochs": Recipe(
            "ppo-hold", ("ppo.batch_size=4096", "ppo.n_epochs=8")
        ),
        "batches of 512, half the epochs": Recipe(
            "ppo-hold", ("ppo.batch_size=512", "ppo.n_epochs=2")
        ),
        "6 epochs, 200,000 steps": Recipe("ppo-hold", ("ppo.n_epochs=6", "total_steps=200000")),
        "former": Recipe("ppo-hold", FORMER_PPO),
        "shipped, SBX": Recipe("ppo-hold", library="sbx"),
    },
    "sac": {
        "shipped": Recipe("sac-hold"),
        "half the updates": Recipe("sac-hold", FEWER),
        "half the updates, SBX": Recipe("sac-hold", FEWER, "sbx"),
    },
}
EVERY = {"ppo": 40_000, "sac": 20_000}
"""Steps between evaluations."""
COLUMNS = (
    "| recipe | seeds of 95 % | success, worst seed (%) | final depth (cm) | final heading (deg) | "
    "processor s, median | longest | wall s, median | longest |\n"
    "| --- | --: | --: | --: | --: | --: | --: | --: | --: |\n"
)


def configuration(algorithm: str, name: str, seed: int) -> TrainConfig:
    """The configuration of a recipe under a seed."""
    recipe = RECIPES[algorithm][name]
    every = f"evaluation.every={EVERY[algorithm]}"
    (trial,) = plan(recipe.config, str(seed), (*recipe.changes, every))
    return trial.config


def judged(agent: Agent, config: TrainConfig) -> dict[str, float]:
    """Success and errors over the episodes that judge."""
    options = config.options(config.disturbances[0], training=False)
    task = options.pop("task")
    suite = Suite("judged", 1, "on no other", JUDGED_FROM, JUDGED, 400, options, {})
    record = swim_suite(suite, task, agent, threads=1)
    names = ("success_rate", "depth_late_rmse_m", "heading_late_rmse_rad", "mean_power_w")
    return {name: float(np.mean(METRICS[name](record))) for name in names}


def row_of(progress: Progress, agent: Agent, config: TrainConfig) -> dict[str, Any]:
    """What is kept of a training: its times (s), evaluations and judgement."""
    return {
        "seed": config.seed,
        "wall_s": progress.wall_s,
        "cpu_s": progress.cpu_s,
        "rollout_cpu_s": progress.rollout_cpu_s,
        "env_cpu_s": progress.env_cpu_s,
        "load_average": os.getloadavg()[0],
        "evaluations": [[row["steps"], row["cpu_s"], row["success_rate"]]
                        for row in progress.evaluations],
        "judged": judged(agent, config),
    }  # fmt: skip


def trained(algorithm: str, name: str, seed: int, folder: Path, sbx: str) -> dict[str, Any]:
    """One training.

    Args:
        algorithm: ``ppo`` or ``sac``.
        name: of the recipe.
        seed: of the training.
        folder: for its run folder, which must not exist.
        sbx: Python that has SBX.
    """
    if RECIPES[algorithm][name].library == "sbx":
        command = [sbx, "-m", "scripts.bench.sbx_training", algorithm, name, str(seed)]
        cache = {"JAX_COMPILATION_CACHE_DIR": str(folder.parent / "jax")}
        done = subprocess.run(
            command, cwd=ROOT, env=os.environ | cache, check=True, stdout=subprocess.PIPE
        )
        row = json.loads(done.stdout.splitlines()[-1])
    else:
        config = configuration(algorithm, name, seed)
        outcome = train(config, folder, Quiet())
        row = row_of(outcome.progress, PretrainedPolicy.load(outcome.policy), config)
    return {"algorithm": algorithm, "recipe": name, **row}


def table(rows: Sequence[dict[str, Any]], algorithm: str) -> str:
    """A line for each recipe of an algorithm."""
    lines = []
    for name in RECIPES[algorithm]:
        own = [row for row in rows if (row["algorithm"], row["recipe"]) == (algorithm, name)]
        if not own:
            continue
        success = [row["judged"]["success_rate"] for row in own]
        depth = median(row["judged"]["depth_late_rmse_m"] for row in own)
        heading = np.degrees(median(row["judged"]["heading_late_rmse_rad"] for row in own))
        times = [[row[key] for row in own] for key in ("cpu_s", "wall_s")]
        held = sum(share >= GOAL for share in success)
        spent = " | ".join(f"{median(column):.1f} | {max(column):.1f}" for column in times)
        lines.append(
            f"| {name} | {held} of {len(own)} | {100 * min(success):.1f} | {100 * depth:.2f} | "
            f"{heading:.2f} | {spent} |\n"
        )
    return COLUMNS + "".join(lines)


def page_of(rows: Sequence[dict[str, Any]]) -> str:
    """The page of all recipes."""
    loads = [row["load_average"] for row in rows]
    head = (
        "# Time to train the task hold\n\n"
        f"`python -m scripts.bench.training`; success and errors over {JUDGED} episodes that no "
        "training, evaluation or suite uses. Final errors are RMS over the last 10 s, medians of "
        "the seeds. Times leave out evaluations. The load average was "
        f"{min(loads):.1f} to {max(loads):.1f} on {os.cpu_count()} cores.\n"
    )
    parts = [f"\n## {name.upper()}\n\n{table(rows, name)}" for name in RECIPES]
    return head + "".join(parts)


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("algorithms", nargs="*", help="ppo, sac, or both; none: only the table")
    parser.add_argument("--seeds", type=int, default=5, help="0 to this less one")
    parser.add_argument("--recipes", nargs="*", help="names; default: all")
    parser.add_argument("--sbx", default="", help="Python that has SBX; else it is left out")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "training-time")
    parser.add_argument("--write", action="store_true", help="write the table into --results")
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    if set(options.algorithms) - set(RECIPES):
        parser.error(f"choose from {', '.join(RECIPES)}")
    options.out.mkdir(parents=True, exist_ok=True)
    console = Console()
    for seed in range(options.seeds):
        for algorithm in options.algorithms:
            for number, (name, recipe) in enumerate(RECIPES[algorithm].items()):
                if options.recipes and name not in options.recipes:
                    continue
                if recipe.library == "sbx" and not options.sbx:
                    continue
                folder = options.out / f"{algorithm}-{number}-{seed}"
                make = partial(trained, algorithm, name, seed, folder, options.sbx)
                row = kept(folder.with_suffix(".json"), make)
                console.print(
                    f"{algorithm}, {name}, seed {seed}: {row['cpu_s']:.1f} s of processor, "
                    f"success {100 * row['judged']['success_rate']:.1f} %"
                )
    files = sorted(options.out.glob("*-*-*.json"))
    rows = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    if rows:
        console.print(page_of(rows))
    if options.write:
        content = {"machine": machine(), "versions": versions(), "rows": rows}
        console.print(write_dated(options.results, "training-time", content, page_of(rows)))


if __name__ == "__main__":
    main()
