"""How long a picture takes, on one core and without a graphics card.

    python -m scripts.bench.rendering

Processor time of this process, the least of five rounds: what else the machine does is left out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import gymnasium as gym
import numpy as np

import fish_env  # noqa: F401  (registers the environment)

FRAMES, ROUNDS = 30, 5
SIZES = ((320, 240), (640, 480), (1280, 720), (1920, 1080))


def seconds_each(draw: Callable[[], object], step: Callable[[], object]) -> float:
    """Processor seconds of one drawing, steps in between left out."""
    rounds = []
    for _ in range(ROUNDS):
        spent = 0.0
        for _ in range(FRAMES):
            step()
            start = time.process_time()
            draw()
            spent += time.process_time() - start
        rounds.append(spent / FRAMES)
    return min(rounds)


def single(size: tuple[int, int]) -> float:
    """Seconds for a picture of one fish with its wake, goal and instruments."""
    env = gym.make("RoboticFish3D-v0", render_mode="rgb_array", render_size=size)
    env.reset(seed=0)
    action = np.array([0.1, 0.2, 0.2, 0.0, 0.0], np.float32)
    return seconds_each(env.render, lambda: env.unwrapped.step(action))


def tiles(count: int, size: tuple[int, int]) -> float:
    """Seconds for a mosaic of as many fish."""
    envs = gym.make_vec(
        "RoboticFish3D-v0", count, render_mode="mosaic", render_count=count, render_size=size
    )
    envs.reset(seed=0)
    actions = np.tile(np.array([0.1, 0.2, 0.2, 0.0, 0.0], np.float32), (count, 1))
    return seconds_each(envs.render, lambda: envs.step(actions))


def main() -> None:
    """Measures, and prints a table."""
    argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0]).parse_args()
    rows = {f"{w} x {h}": single((w, h)) for w, h in SIZES}
    rows |= {f"mosaic of {n}, 960 x 720": tiles(n, (960, 720)) for n in (4, 9)}
    print("| picture | ms | pictures/s |\n| --- | --: | --: |")
    for name, seconds in rows.items():
        print(f"| {name} | {1000 * seconds:.1f} | {1 / seconds:.0f} |")


if __name__ == "__main__":
    main()
