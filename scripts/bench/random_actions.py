"""Ten million steps of random actions: no number that is not a number, and how episodes end.

Run it as ``python -m scripts.bench.random_actions``; ``--steps`` for fewer.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Mapping

import gymnasium as gym
import numpy as np

import fish_env  # noqa: F401  (registers the environment)
from fish_env.envs.layout import Failure
from scripts.bench import harness


def not_finite(obs: np.ndarray, reward: np.ndarray, info: Mapping[str, np.ndarray]) -> list[str]:
    """Names of what holds a NaN or an infinity."""
    found = [name for name, array in (("obs", obs), ("reward", reward)) if not _finite(array)]
    return found + [f"info {name}" for name, array in info.items() if not _finite(array)]


def _finite(array: np.ndarray) -> bool:
    return bool(np.isfinite(array).all())


def swim(steps: int, envs: int, seed: int, quiet: bool = False) -> Counter[str]:
    """Step until ``steps`` environment steps are done; count how episodes end.

    Raises:
        ValueError: something is not finite; says what, and after how many steps.
    """
    env = gym.make_vec("RoboticFish3D-v0", num_envs=envs)
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    ends: Counter[str] = Counter()
    rounds = -(-steps // envs)
    for i in range(rounds):
        actions = rng.uniform(-1, 1, (envs, 5)).astype(np.float32)
        obs, reward, terminated, truncated, info = env.step(actions)
        bad = not_finite(obs, reward, info)
        if bad:
            raise ValueError(f"not finite after {(i + 1) * envs} steps: {', '.join(bad)}")
        ends["time limit"] += int(truncated.sum())
        for code in info["failure"][terminated].astype(int):
            ends[Failure(code).name.lower()] += 1
        if not quiet and (i + 1) % max(1, rounds // 10) == 0:
            print(f"{(i + 1) * envs:>12,} steps", file=sys.stderr, flush=True)
    return ends


def main(argv: list[str] | None = None) -> None:
    """Swim, count, print; exit status 1 if anything is not finite."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.random_actions")
    parser.add_argument("--steps", type=int, default=10_000_000, help="environment steps")
    parser.add_argument("--envs", type=int, default=1024, help="environments at once")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(argv)
    started = time.perf_counter()
    try:
        ends = swim(options.steps, options.envs, options.seed)
    except ValueError as error:
        sys.exit(str(error))
    taken = time.perf_counter() - started
    print(harness.machine())
    print(f"{options.steps:,} steps in {taken:.1f} s, checks included; everything finite")
    print(f"{ends.total():,} episodes ended:")
    for name, count in ends.most_common():
        print(f"  {name}: {count:,}")


if __name__ == "__main__":
    main()
