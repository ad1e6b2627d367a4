"""Compares agents on episodes of a suite's kind that belong to no suite, training or tuning.

    python -m scripts.compare_agents pretrained pid --task hold --suite hard
    python -m scripts.compare_agents agents/robofish_agents/pretrained/track out/mine/policies

A name is as for `robofish evaluate --agent`. All agents swim the same episodes. Each later one is
compared with the first, episode by episode; learned ones are means over their training seeds.
Intervals are 95 %, over episodes. Shares of failures are those with a late error beyond its limit.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.tasks import SIGNAL_TASKS
from robofish_agents.evaluation.metrics import LATE_S, METRICS, success_rate
from robofish_agents.evaluation.record import Record, swim_suite
from robofish_agents.evaluation.suites import RESERVED_SEEDS, Suite, load_suite, suite_names
from robofish_agents.registry import Agent, load_agents

FIRST_SEED = 19_000_000
assert FIRST_SEED not in RESERVED_SEEDS
UNITS = {"depth_rmse_m": (100.0, "cm"), "heading_rmse_rad": (57.2958, "degrees")}
UNITS |= {"mean_power_w": (1000.0, "mW")}


def measured(agent: Agent, suite: Suite, task: str) -> tuple[FloatArray, dict[str, float]]:
    """Success of each episode, and means over them in the units that are printed."""
    record = swim_suite(suite, task, agent, threads=1)
    success = success_rate(record)
    means = {f"out in {name}": 100.0 * share for name, share in outside(record, success).items()}
    for key, (factor, unit) in UNITS.items():
        means[unit] = factor * float(np.mean(METRICS[key](record)))
    return success, means


def outside(record: Record, success: FloatArray) -> dict[str, float]:
    """Share of episodes that fail with a late error of depth, heading or speed out of its limit."""
    late = slice(-round(LATE_S / record.period_s), None)
    limits = {"depth": record.limits["depth"], "heading": record.limits["heading"]}
    speed = record.limits["speed"] * record.info["goal_speed"][-1]
    limits["speed"] = np.maximum(speed, record.limits["speed_floor"])
    return {
        name: float(np.mean((np.abs(record.info[f"{name}_error"][late]) > limit).any(axis=0)
                            & (success == 0.0)))
        for name, limit in limits.items()
    }  # fmt: skip


def interval(values: FloatArray) -> str:
    """Mean and half width of its 95 % interval, in percent."""
    half = 1.96 * values.std(ddof=1) / np.sqrt(len(values))
    return f"{100 * values.mean():+.2f} ± {100 * half:.2f}"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    add = parser.add_argument
    add("agents", nargs="+", help="pid, mppi, pretrained, or the path of a policy or of a folder")
    add("--task", choices=tuple(SIGNAL_TASKS), default="track")
    add("--suite", choices=suite_names(*SIGNAL_TASKS), default="hard")
    add("--episodes", type=int, default=2000)
    add("--first", type=int, default=FIRST_SEED, help="seed of the first episode")
    options = parser.parse_args(arguments)
    last = options.first + options.episodes - 1
    if RESERVED_SEEDS.start <= last and options.first < RESERVED_SEEDS.stop:
        parser.error("these episodes belong to the suites; give another --first")
    suite = replace(load_suite(options.suite), seed=options.first, episodes=options.episodes)
    reference: FloatArray | None = None
    for name in options.agents:
        rows = [measured(agent, suite, options.task) for agent in load_agents(name, options.task)]
        success = np.mean([row[0] for row in rows], axis=0)
        seeds = ", ".join(f"{100 * row[0].mean():.2f}" for row in rows)
        means = {key: np.mean([row[1][key] for row in rows]) for key in rows[0][1]}
        print(f"{name}: success {100 * success.mean():.2f} % ({seeds})", end="; ")
        print("; ".join(f"{value:.2f} {key}" for key, value in means.items()))
        if reference is not None:
            print(f"  beside {options.agents[0]}: {interval(success - reference)} %")
        reference = success if reference is None else reference


if __name__ == "__main__":
    main()
