"""Measures trained policies on the frozen suites and puts them, with cards, into the package.

    python -m scripts.ship_policies out/train/ppo-track-seed-* out/train/ppo-hold-all-seed-*

Each folder is that of a finished training; what it trained becomes
``agents/robofish_agents/pretrained/TASK/seed-SEED.npz``, for its own task or those given with
--task.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.progress import track

from robofish_agents.evaluation.metrics import METRICS
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import load_suite, suite_names
from robofish_agents.policies import PolicyFile, PretrainedPolicy, read_policy, write_policy
from robofish_agents.policies.pretrained import SHIPPED
from robofish_agents.training.run import POLICY

SCORES = ("success_rate", "depth_rmse_m", "heading_rmse_rad", "mean_power_w", "episode_return")


def scores(policy: PolicyFile, task: str) -> dict[str, dict[str, Any]]:
    """Suite -> its version and the mean of each of SCORES."""
    rows: dict[str, dict[str, Any]] = {}
    for name in suite_names(task):
        suite = load_suite(name)
        suite.check(task)
        record = swim_suite(suite, task, PretrainedPolicy(policy))
        means = {key: round(float(np.mean(METRICS[key](record))), 5) for key in SCORES}
        rows[name] = {"version": suite.version, **means}
    return rows


def ship(folder: Path, task: str | None) -> None:
    """Puts the policy of a training into the package, with its scores on its card."""
    policy = read_policy(folder / POLICY)
    into = task or policy.task
    about = {**policy.card, "scores": {"task": into, **scores(policy, into)}}
    path = SHIPPED / into / f"seed-{policy.card['seed']}.npz"
    write_policy(replace(policy, card=about), path)
    text = yaml.safe_dump(about, sort_keys=False, allow_unicode=True)
    path.with_suffix(".yaml").write_text(text, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--task", choices=("hold", "track", "station"), default=None)
    options = parser.parse_args()
    for folder in track(options.folders, "measuring"):
        ship(folder, options.task)


if __name__ == "__main__":
    main()
