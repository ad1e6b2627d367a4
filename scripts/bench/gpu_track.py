"""Trains `track` from nothing on a GPU, and judges the policies on fish they did not train with.

    python -m scripts.bench.gpu_track --seeds 0 1 2 3 4 --folder out/gpu-track

Neither a controller nor a policy made before is imitated. For each seed the folder gets a policy
file, for `robofish evaluate --agent FILE`, and `curve.json` has success and cost over time. Needs
the extra ``gpu`` and PyTorch with CUDA.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch

from fish_env.envs.registration import ENV_ID
from fish_env.files import write_bytes
from fish_env.gpu.vector import RoboticFish3DDeviceEnv
from robofish_agents.policies.files import PolicyFile, write_policy
from robofish_agents.training.actor_critic import ActorCritic, network_of
from robofish_agents.training.config import TrainConfig, load_train_config
from robofish_agents.training.tensor_engine import recipe_of
from robofish_agents.training.tensor_ppo import LIMIT, success_rate, train
from robofish_agents.training.tensor_shoal import TensorShoal

FISH = 16384
"""On a GPU; configurations have as many as a CPU can swim."""
JUDGED = 2048
"""Fish of a condition on whose episodes a policy is judged."""
JUDGE_SEED = 1_000_000


def arguments(argv: list[str] | None = None) -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.gpu_track")
    add = parser.add_argument
    add("--config", default="ppo-track-gpu", help="training configuration (ppo-track-gpu)")
    add("--seeds", type=int, nargs="+", default=range(5), help="of the trainings (0 to 4)")
    add("--seconds", type=float, help="about how long one may take, in place of its steps")
    add("--fish", type=int, default=FISH, help=f"in place of those of the configuration ({FISH})")
    add("--looks", type=int, default=8, help="how often a training is judged on its way (8)")
    add("--folder", type=Path, default=Path("out/gpu-track"), help="for policies and curve.json")
    return parser.parse_args(argv)


def fish_of(config: TrainConfig, training: bool, counts: Mapping[str, int]) -> dict[str, Any]:
    """Fish of each condition, so many of each."""
    return {
        name: RoboticFish3DDeviceEnv(count, **config.options(name, training))
        for name, count in counts.items()
    }


class Trainings:
    """One after another on the same fish, judged on their way.

    Args:
        config: what to train.
        fish: number of fish.
        looks: how often one is judged on its way.
    """

    def __init__(self, config: TrainConfig, fish: int, looks: int) -> None:
        self.config, self.looks = config, looks
        self.recipe = replace(
            recipe_of(config),
            iterations=config.total_steps // (config.ppo.n_steps * fish),
            reward_scale=0.1,
        )
        names = config.disturbances
        shares = {name: fish * times // len(names) for name, times in Counter(names).items()}
        self.parts = list(fish_of(config, True, shares).values())
        self.judges = fish_of(config, False, dict.fromkeys(shares, JUDGED))
        self.spec = config.history_spec(self.parts[0].batch.options.config.control_period)

    def warm_up(self, seconds: float | None) -> None:
        """Compile, and choose the number of rollouts if a training may take so many seconds."""
        train(TensorShoal(self.parts, self.spec), self.recipe.shortened(3), 0)
        if seconds:
            few = 20
            done = train(TensorShoal(self.parts, self.spec), self.recipe.shortened(few), 0)
            again = train(TensorShoal(self.parts, self.spec), self.recipe.shortened(3), 0)
            each = (done.seconds - again.seconds) / (few - 3)
            self.recipe = self.recipe.shortened(int(seconds / each))
            print(f"{1e3 * each:.1f} ms a rollout: {self.recipe.iterations} rollouts", flush=True)

    def run(self, seed: int, folder: Path) -> dict[str, Any]:
        """One training; returns its curve."""
        shoal = TensorShoal(self.parts, self.spec)
        recipe, started, rows, spent = self.recipe, time.perf_counter(), [], 0.0

        def watch(rollouts: int, policy: ActorCritic) -> None:
            nonlocal spent
            if rollouts % max(recipe.iterations // self.looks, 1) and rollouts < recipe.iterations:
                return
            before = time.perf_counter()
            row = {
                "seconds": before - started - spent,
                "steps": rollouts * recipe.steps * shoal.num_envs,
                "deviation": policy.log_std.exp().mean().item(),
                "success": self.judged(shoal, policy),
            }
            rows.append(row)
            print(seed, row, flush=True)
            self.write(shoal, policy, seed, folder, row)
            spent += time.perf_counter() - before

        done = train(shoal, recipe, seed, watch)
        return {"seed": seed, "seconds": done.seconds, "steps": done.steps, "curve": rows}

    def judged(self, shoal: TensorShoal, policy: ActorCritic) -> dict[str, float]:
        """Success in each condition, on fish of no training."""
        return {
            name: success_rate(TensorShoal([part], self.spec, shoal), policy, JUDGE_SEED)
            for name, part in self.judges.items()
        }

    def write(
        self, shoal: TensorShoal, policy: ActorCritic, seed: int, folder: Path, row: dict[str, Any]
    ) -> None:
        """Writes the policy as it is now."""
        scale = shoal.seen
        mean, deviation = (rows.cpu().numpy() for rows in (scale.mean, scale.deviation()))
        card = {"configuration": self.config.tree(), "seed": seed, "training": row}
        network = network_of(policy, mean, deviation, LIMIT)
        file = PolicyFile(network, self.spec, self.config.task, ENV_ID, card)
        write_policy(file, folder / f"seed-{seed}.npz")


def main(argv: list[str] | None = None) -> None:
    """Train, judge, write."""
    options = arguments(argv)
    torch.set_float32_matmul_precision("high")
    config = load_train_config(options.config)
    options.folder.mkdir(parents=True, exist_ok=True)
    trainings = Trainings(config, options.fish, options.looks)
    started = time.perf_counter()
    trainings.warm_up(options.seconds)
    found = {"compiled_s": time.perf_counter() - started, "trainings": []}
    for seed in options.seeds:
        found["trainings"].append(trainings.run(seed, options.folder))
        write_bytes(options.folder / "curve.json", json.dumps(found, indent=1).encode())


if __name__ == "__main__":
    main()
