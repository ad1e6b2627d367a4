"""Speed, accuracy and training on a GPU, beside the CPU and MJX in the same run.

    python -m scripts.bench.gpu              # some minutes; writes results/gpu-<date>.json and .md
    python -m scripts.bench.gpu --no-train   # speed and accuracy alone

A *control step* is one step of one fish of the environment: ten Runge-Kutta steps of the physics,
goal, reward, observation and, where an episode ends, its restart. Needs the extra ``gpu``, PyTorch
with CUDA, and, to compare, ``pip install mujoco-mjx``; what is missing is listed as missing.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from fish_env.envs.batch import FishBatch
from fish_env.envs.options import env_options
from fish_env.errors import ConfigError
from fish_env.gpu.batch import DeviceBatch
from fish_env.gpu.compiled import check_device
from fish_env.gpu.target import SIMULATED
from scripts.bench import gpu_contenders, harness
from scripts.results import RESULTS, write_dated

COUNTS = (2**12, 2**15, 2**17)
TARGET = 50e6
"""Control steps a second of the environment in float32 at the largest count."""
PACKAGES = (*harness.PACKAGES, "numba-cuda", "jax", "mujoco-mjx")
SEEDS = range(5)
GOAL = 0.95


def arguments(argv: list[str] | None = None) -> argparse.Namespace:
    """Options of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m scripts.bench.gpu", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, help="numbers of fish")
    parser.add_argument("--rounds", type=int, default=9, help="timings of each contender (9)")
    parser.add_argument("--seconds", type=float, default=0.4, help="of each timing (0.4)")
    parser.add_argument("--only", default="", help="contenders with this text in their name")
    parser.add_argument("--no-train", action="store_true", help="leave out the training")
    parser.add_argument("--dry", action="store_true", help="write nothing")
    return parser.parse_args(argv)


def gpu_name() -> str:
    """What computes."""
    if SIMULATED:
        return "numba's simulator of CUDA"
    import torch

    return str(torch.cuda.get_device_name())


def accuracy(precision: str, count: int, steps: int) -> dict[str, Any]:
    """Largest differences between device and CPU after some control steps of random actions.

    Args:
        precision: of the device; the CPU computes in float64.
        count: fish.
        steps: control steps.
    """
    options = env_options()
    batch = FishBatch(options, count)
    rngs = [np.random.default_rng(i) for i in range(count)]
    batch.reset(np.arange(count), rngs)
    device = DeviceBatch(options, count, precision=precision, autoreset="disabled")
    device.load(batch)
    random, apart = np.random.default_rng(0), {}
    for step in range(1, steps + 1):
        actions = random.uniform(-1.0, 1.0, (count, 5)).astype(np.float32)
        batch.step(actions)
        device.actions.copy_to_device(actions)
        device.step()
        if step in (1, 10, steps):
            state = device.state.copy_to_host().astype(float)[:14]
            apart[f"state after {step} steps"] = float(np.abs(state - batch.state[:14]).max())
    seen = np.abs(device.obs.copy_to_host() - batch.obs).max()
    return {"precision": precision, "fish": count, **apart, "observation at the end": float(seen)}


def speeds(options: argparse.Namespace) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """Rates of all contenders in one run, and who could not take part."""
    chosen = [
        (name, tried(make))
        for name, make in gpu_contenders.builders(tuple(options.counts))
        if options.only.lower() in name.lower()
    ]
    contenders, missing = harness.build(chosen)
    measured = harness.measure(contenders, options.rounds, options.seconds)
    rows = []
    for one in measured:
        spread, contender = harness.Spread.of(one.rates), one.contender
        rows.append(
            {
                "name": contender.name,
                "environments": contender.envs,
                "environment": contender.environment,
                "substeps": contender.substeps,
                "control_steps_per_s": spread.median,
                "quartiles": [spread.low, spread.high],
                "physics_steps_per_s": spread.median * contender.substeps,
            }
        )
    return rows, [{"name": m.name, "reason": m.reason} for m in missing]


def tried(make: Callable[[], harness.Contender]) -> Callable[[], harness.Contender]:
    """A contender that was run once; one that fails counts as missing, and says why.

    The time of a GPU is dear: the others are to be measured all the same.
    """

    def made() -> harness.Contender:
        try:
            contender = make()
            contender.run(1)
        except Exception as error:
            raise ImportError(f"{type(error).__name__}: {error}") from error
        return contender

    return made


def trainings() -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """Times and successes of the training on the device under five seeds, and what failed."""
    from fish_env.gpu.vector import RoboticFish3DDeviceEnv
    from robofish_agents.training.actor_critic import HOLD, HOLD_FISH
    from robofish_agents.training.tensor_ppo import success_rate, train

    rows: list[dict[str, Any]] = []
    try:
        env, judge = RoboticFish3DDeviceEnv(HOLD_FISH), RoboticFish3DDeviceEnv(1024)
        train(env, HOLD.shortened(2), 0)  # compiles
        for seed in SEEDS:
            trained = train(env, HOLD, seed)
            rate = success_rate(judge, trained.policy, 1000 + seed)
            rows.append(
                {
                    "seed": seed,
                    "seconds": trained.seconds,
                    "control_steps": trained.steps,
                    "success_rate": rate,
                }
            )
            print(rows[-1], flush=True)
    except Exception as error:
        return rows, [{"name": "training", "reason": f"{type(error).__name__}: {error}"}]
    return rows, []


def page(content: dict[str, Any]) -> str:
    """The results as Markdown."""
    lines = [
        f"# The environment on {content['gpu']}",
        "",
        "| contender | environments | control steps a second | physics steps a second |",
        "| --- | --: | --: | --: |",
    ]
    for row in sorted(content["speed"], key=lambda row: -row["control_steps_per_s"]):
        lines.append(
            f"| {row['name']} | {row['environments']:,} | {row['control_steps_per_s']:,.0f} | "
            f"{row['physics_steps_per_s']:,.0f} |"
        )
    lines += ["", *(f"Missing: {m['name']} ({m['reason']})" for m in content["missing"])]
    for row in content["accuracy"]:
        apart = ", ".join(f"{name}: {value:.2g}" for name, value in row.items() if name[0] in "so")
        lines.append(f"\nLargest difference from the CPU, {row['precision']}: {apart}.")
    rows = content["training"]
    if rows:
        held = sum(row["success_rate"] >= GOAL for row in rows)
        lines.append(
            f"\nPPO on `hold`: {held} of {len(rows)} seeds reach {GOAL:.0%}; median "
            f"{median(row['seconds'] for row in rows):.2f} s."
        )
    return "\n".join(lines) + "\n"


def main(argv: list[str] | None = None) -> None:
    """Measure, print, write."""
    options = arguments(argv)
    try:
        check_device()
    except ConfigError as error:
        sys.exit(str(error))
    started = time.perf_counter()
    few = min(256, options.counts[-1])
    trained, failed = ([], []) if options.no_train else trainings()
    rows, missing = speeds(options)
    content: dict[str, Any] = {
        "command": "python -m scripts.bench.gpu " + " ".join(argv or sys.argv[1:]),
        "gpu": gpu_name(),
        "machine": harness.machine(),
        "versions": harness.versions(PACKAGES),
        "target_control_steps_per_s": TARGET,
        "speed": rows,
        "missing": missing + failed,
        "accuracy": [accuracy(p, few, 3 if SIMULATED else 100) for p in ("float64", "float32")],
        "training": trained,
        "seconds": time.perf_counter() - started,
    }
    print(page(content))
    if not options.dry:
        print(f"written: {write_dated(RESULTS, 'gpu', content, page(content))}")


if __name__ == "__main__":
    main()
