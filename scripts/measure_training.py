"""Times trainings of `ppo-hold` by recipe: `python -m scripts.measure_training`.

Each recipe is the shipped configuration with some keys changed. All are trained under a seed before
the next seed begins, so a machine that is slow for a while is so for all. What is finished is
kept in --out and not done again. Writes a dated table and its numbers into results/.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console

from robofish_agents.sweep.plan import plan
from robofish_agents.training.books import Quiet
from robofish_agents.training.run import train
from scripts.bench.harness import machine, versions
from scripts.results import RESULTS, ROOT, kept, write_dated

CONFIG = "ppo-hold"
GOAL = 0.95
EVERY = "evaluation.every=20000"
"""Steps between evaluations. They are not counted into the times."""
LAYERS = "network.layers=[32, 32]"
QUICK = (
    "total_steps=160000", "num_envs=128", "ppo.n_steps=32", "ppo.n_epochs=10",
    "ppo.learning_rate.start=2.0e-3",
)  # fmt: skip
RECIPES: dict[str, tuple[str, ...]] = {
    "as shipped": (),
    "quick: 160,000 steps, 10 epochs, rate 2e-3": QUICK,
    "quick, two threads of PyTorch": (*QUICK, "threads.torch=2"),
    "quick, 6 epochs": (*QUICK[:3], QUICK[4], "ppo.n_epochs=6"),
    "quick, batches of 4096": (*QUICK, "ppo.batch_size=4096"),
    "quick, layers of 32, 200,000 steps": (*QUICK[1:], "total_steps=200000", LAYERS),
}
COLUMNS = (
    "| recipe | seeds that reach 95 % | seconds, median | longest | processor seconds to 95 %, "
    "median | longest | share of rollouts |\n| --- | --: | --: | --: | --: | --: | --: |\n"
)


def trained(recipe: str, seed: int, folder: Path) -> dict[str, Any]:
    """One training: its times (s) and evaluations.

    Args:
        recipe: of :data:`RECIPES`.
        seed: of the training.
        folder: for its run folder, which must not exist.
    """
    (trial,) = plan(CONFIG, str(seed), (*RECIPES[recipe], EVERY))
    progress = train(trial.config, folder, Quiet()).progress
    rows = progress.evaluations
    reached = [row["cpu_s"] for row in rows if row["success_rate"] >= GOAL]
    return {
        "recipe": recipe,
        "seed": seed,
        "wall_s": progress.wall_s,
        "cpu_s": progress.cpu_s,
        "rollout_cpu_s": progress.rollout_cpu_s,
        "cpu_s_to_goal": reached[0] if reached else None,
        "success": [row["success_rate"] for row in rows],
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """A line for each recipe."""
    lines = []
    for recipe in RECIPES:
        own = [row for row in rows if row["recipe"] == recipe]
        if not own:
            continue
        held = sum(max(row["success"]) >= GOAL for row in own)
        wall = [row["wall_s"] for row in own]
        goal = [row["cpu_s_to_goal"] for row in own if row["cpu_s_to_goal"] is not None]
        reached = f"{median(goal):.1f} | {max(goal):.1f}" if len(goal) == len(own) else "- | -"
        share = median(row["rollout_cpu_s"] / row["cpu_s"] for row in own)
        lines.append(
            f"| {recipe} | {held} of {len(own)} | {median(wall):.1f} | {max(wall):.1f} | "
            f"{reached} | {100 * share:.0f} % |\n"
        )
    return COLUMNS + "".join(lines)


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="0 to this less one")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "training-time")
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    console, rows = Console(), []
    for seed in range(options.seeds):
        for number, recipe in enumerate(RECIPES):
            folder = options.out / f"{number}-{seed}"
            make = partial(trained, recipe, seed, folder)
            rows.append(kept(folder.with_suffix(".json"), make))
            console.print(f"{recipe}, seed {seed}: {rows[-1]['wall_s']:.1f} s")
    content = {"machine": machine(), "versions": versions(), "rows": rows}
    page = f"# Time to train {CONFIG}\n\n{table(rows)}"
    console.print(write_dated(options.results, "training-time", content, page))
    console.print(table(rows))


if __name__ == "__main__":
    main()
