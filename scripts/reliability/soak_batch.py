"""Many steps of the native batch under the widest draws, and with denormal numbers."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fish_env.envs.layout import Failure
from fish_env.envs.vector import RoboticFish3DVectorEnv
from scripts.bench.random_actions import not_finite
from scripts.reliability import widest

Actions = np.ndarray
SMALLEST = 5e-324
"""The smallest double above zero, a denormal."""
KINDS = ("random", "extremes", "denormal", "small")
"""Blocks of actions. The last two are alike but for the size of their numbers, so that the ratio
of their times is what denormals cost."""
BLOCK = 50
"""Control steps of a block."""


RANDOM = {"lean": 10, "effects": 3, "bounds": 1}
"""Blocks of random actions in a round, for each draw."""
SELDOM = 10
"""The slow draws to all bounds come once in so many rounds, with a sixteenth of the fish."""


@dataclass(frozen=True)
class Swimmers:
    """A batch with its draws.

    Attributes:
        name: of the draws: "lean" (coefficients wrong by a factor, no effects), "effects" (all
            effects too) or "bounds" (everything to its legal ends).
        env: the batch.
    """

    name: str
    env: RoboticFish3DVectorEnv


def make(name: str, envs: int, threads: int | None = None) -> Swimmers:
    """A batch whose fish are drawn anew in each episode, as widely as its name says."""
    ranges, water = {
        "lean": (widest.swimmable, widest.DEEP),
        "effects": (widest.with_effects, widest.DEEP),
        "bounds": (widest.bounds, widest.WATER),
    }[name]
    count = envs if name != "bounds" else max(1, envs // 16)
    env = RoboticFish3DVectorEnv(count, threads=threads, randomization=ranges(), **water)
    return Swimmers(name, env)


def start_of(kind: str) -> dict[str, Any]:
    """Reset options of a block: a fish all but at rest, by denormal or by small numbers."""
    size = {"denormal": SMALLEST, "small": 1e-3}[kind]
    three = [size, -size, size]
    state = {"velocity_body": three, "angular_velocity_body": three, "euler": three}
    return {"state": state | {"tail_phase": size}}


def actions_of(kind: str, envs: int, rng: np.random.Generator) -> Iterator[Actions]:
    """Actions of a block, one batch for each control step."""
    rest = np.array([0.0, -1.0, -1.0, 0.0, 0.0], np.float32)
    for _ in range(BLOCK):
        if kind == "random":
            yield rng.uniform(-1.0, 1.0, (envs, 5)).astype(np.float32)
        elif kind == "extremes":
            yield rng.choice(np.float32([-1.0, 1.0, -3e38, 3e38, 1e-45]), (envs, 5))
        else:
            size = np.float32(1e-45 if kind == "denormal" else 1e-3)
            yield np.where(rest == 0.0, size, rest) * np.ones((envs, 1), np.float32)


def swim_block(
    swimmers: Swimmers, kind: str, rng: np.random.Generator, ends: Counter[str]
) -> float:
    """One block, every number checked.

    Returns:
        Processor time of the steps alone (s).

    Raises:
        ValueError: something is not finite; says what.
    """
    env, taken = swimmers.env, 0.0
    if kind in ("denormal", "small"):
        env.reset(options=start_of(kind))
    for actions in actions_of(kind, env.num_envs, rng):
        started = time.process_time()
        obs, reward, terminated, truncated, info = env.step(actions)
        taken += time.process_time() - started
        bad = not_finite(obs, reward, info)
        if not np.isfinite(env.batch.state).all():
            bad.append("state")
        if bad:
            raise ValueError(f"{swimmers.name}, {kind}: not finite: {', '.join(bad)}")
        ends["time limit"] += int(truncated.sum())
        ends.update(Failure(int(code)).name.lower() for code in info["failure"][terminated])
    return taken


def soak(
    steps: int,
    envs: int,
    seed: int = 0,
    threads: int | None = None,
    every: Callable[[int], bool] = lambda done: True,
) -> dict[str, Any]:
    """Steps the batches in blocks of each kind by turns.

    Args:
        steps: of all fish together, at least so many.
        envs: fish in a batch.
        seed: of actions and episodes.
        threads: of the batch; default: all cores.
        every: told the steps done after each round of blocks; False ends the run.

    Returns:
        Steps, seconds, how episodes ended and, for each draw, what denormals cost in time.

    Raises:
        ValueError: something is not finite.
    """
    rng = np.random.default_rng(seed)
    swimmers = [make(name, envs, threads) for name in RANDOM]
    for each in swimmers:
        each.env.reset(seed=seed)
    ends = {each.name: Counter[str]() for each in swimmers}
    done: Counter[str] = Counter()
    times: dict[str, list[float]] = {}
    started, rounds, go_on = time.perf_counter(), 0, True
    while go_on and done.total() < steps:
        for each in swimmers:
            if each.name == "bounds" and rounds % SELDOM:
                continue
            # In another order each time: what else the machine does must not favour a kind.
            for kind in map(str, ("random",) * RANDOM[each.name] + (*rng.permutation(KINDS[1:]),)):
                taken = swim_block(each, kind, rng, ends[each.name])
                times.setdefault(f"{each.name}, {kind}", []).append(taken)
                done[each.name] += BLOCK * each.env.num_envs
        rounds, go_on = rounds + 1, every(done.total())
    for each in swimmers:
        each.env.close()
    return {
        "steps": done.total(),
        "steps_by_draws": dict(done),
        "seconds": round(time.perf_counter() - started, 1),
        "cpu_seconds_of_steps": round(sum(map(sum, times.values())), 1),
        "drawn_parameters": {each.name: len(each.env.batch.drawn) for each in swimmers},
        "ends": {name: dict(count) for name, count in ends.items()},
        "denormals": {each.name: denormal_cost(times, each.name) for each in swimmers},
    }


def denormal_cost(times: Mapping[str, list[float]], name: str) -> dict[str, float]:
    """Processor time with denormals as a ratio to that with small numbers: the median."""
    ratios = np.array(times[f"{name}, denormal"]) / np.array(times[f"{name}, small"])
    return {"median_time_ratio": round(float(np.median(ratios)), 3), "blocks": len(ratios)}
