"""How long a user waits: importing, the first step, and compiling on a new machine.

    python -m scripts.bench.startup

Each number comes from fresh processes: the median of five, one for the cold start, which compiles
into an empty folder. A cold start happens once for a version of the package on a machine.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass

from scripts.bench import harness

IMPORT = """
import time
start = time.perf_counter()
import fish_env
print(time.perf_counter() - start)
"""
FIRST_STEP = """
import time
import gymnasium as gym
import fish_env
start = time.perf_counter()
env = gym.make("RoboticFish3D-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.perf_counter() - start)
"""
COLD = """
import time
start = time.perf_counter()
import gymnasium as gym
import fish_env
env = gym.make("RoboticFish3D-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
many = gym.make_vec("RoboticFish3D-v0", num_envs=16)
many.reset(seed=0)
many.step(many.action_space.sample())
print(time.perf_counter() - start)
"""


@dataclass(frozen=True)
class Wait:
    """One thing a user waits for.

    Attributes:
        name: what happens.
        program: Python source that prints the seconds it took.
        limit_s: promised.
        cold: in an empty cache folder, once.
    """

    name: str
    program: str
    limit_s: float
    cold: bool = False


WAITS = (
    Wait("warm import of fish_env", IMPORT, 0.5),
    Wait("warm gym.make to the first step", FIRST_STEP, 1.5),
    Wait("cold start: import, compile, first step of one and of many", COLD, 60.0, cold=True),
)


def run_program(program: str, **environment: str) -> float:
    """Seconds that a program reports, run in a fresh process."""
    command = [sys.executable, "-c", program]
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"the program failed:\n{done.stderr}")
    return float(done.stdout.split()[-1])


def measure(wait: Wait, repeats: int) -> list[float]:
    """Seconds of each repeat; a warm one is preceded by a run that fills the caches."""
    if wait.cold:
        with tempfile.TemporaryDirectory() as folder:
            return [run_program(wait.program, ROBOFISH_CACHE_DIR=folder)]
    run_program(wait.program)
    return [run_program(wait.program) for _ in range(repeats)]


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.startup")
    parser.add_argument("--repeats", type=int, default=5, help="processes for each warm number")
    repeats = parser.parse_args(argv).repeats
    print(f"{harness.machine()}\n")
    for wait in WAITS:
        times = measure(wait, repeats)
        median = statistics.median(times)
        word = "met" if median <= wait.limit_s else "missed"
        spread = f"{min(times):.2f} to {max(times):.2f}"
        print(f"{wait.name}: {median:.2f} s ({spread}), at most {wait.limit_s:g} s: {word}")


if __name__ == "__main__":
    main()
