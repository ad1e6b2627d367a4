"""This project's contenders: the environments, and the bare simulator behind them."""

from __future__ import annotations

from collections.abc import Callable

import gymnasium as gym
import numpy as np

import fish_env  # noqa: F401  (registers the environment)
from fish_env import load_fish
from fish_env.effects.extended import build_model
from fish_env.model.grid import Grid
from scripts.bench.harness import Contender

ENV_ID = "RoboticFish3D-v0"
DRAWN = 256
"""Actions are drawn before the clock starts, this many, and used in turn."""


def drawn_actions(shape: tuple[int, ...], seed: int = 0) -> np.ndarray:
    """Uniform actions in [-1, 1], shape (DRAWN, *shape), float32."""
    return np.random.default_rng(seed).uniform(-1, 1, (DRAWN, *shape)).astype(np.float32)


def single() -> Contender:
    """One environment, made and wrapped by ``gymnasium.make``."""
    env = gym.make(ENV_ID)
    env.reset(seed=0)
    actions = drawn_actions((5,))

    def run(steps: int) -> None:
        for i in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[i % DRAWN])
            if terminated or truncated:
                env.reset()

    config = env.unwrapped.options.config
    return Contender(
        f"{ENV_ID}, gym.make", 1, 1, config.control_period, config.substeps, "RK4", run
    )


def vector(envs: int, threads: int) -> Contender:
    """The native vector environment, which restarts ended episodes itself."""
    env = gym.make_vec(ENV_ID, num_envs=envs, threads=threads)
    env.reset(seed=0)
    actions = drawn_actions((envs, 5))

    def run(steps: int) -> None:
        for i in range(steps):
            env.step(actions[i % DRAWN])

    config = env.options.config
    name = f"{ENV_ID}, gym.make_vec {envs}"
    return Contender(name, envs, threads, config.control_period, config.substeps, "RK4", run)


def start_state(envs: int, seed: int = 0) -> np.ndarray:
    """Cruising fish in random attitudes near level, base states, shape (18, envs)."""
    rng = np.random.default_rng(seed)
    state = np.zeros((18, envs))
    state[3:7] = rng.normal(size=(4, envs)) + np.array([6.0, 0.0, 0.0, 0.0])[:, None]
    state[3:7] /= np.linalg.norm(state[3:7], axis=0)
    state[7] = 0.1 + 0.05 * rng.normal(size=envs)
    state[8:13] = 0.1 * rng.normal(size=(5, envs))
    state[13] = rng.uniform(0.0, 6.0, envs)
    return state


def drawn_commands(shape: tuple[int, ...], seed: int = 1) -> np.ndarray:
    """Random actuator targets (rad, rad, Hz, m, rad), shape (shape[0], 5, *shape[1:])."""
    low = np.array([-0.5, 0.0, 0.5, -0.01, -0.5])
    high = np.array([0.5, 0.6, 3.0, 0.01, 0.5])
    drawn = np.random.default_rng(seed).uniform(low, high, (*shape, 5))
    return np.ascontiguousarray(np.moveaxis(drawn, -1, 1))


def schedule_grid(first: int, count: int, substeps: int = 10, dt: float = 0.01) -> Grid:
    """Commands ``first`` and on, ``count`` of them, each held for ``substeps`` physics steps."""
    ones = np.ones(count, np.int64)
    slots = np.arange(first, first + count)
    starts = np.arange(count) * (substeps * dt)
    return Grid(slots, starts, substeps * ones, dt * ones, np.iinfo(np.int64).max * ones)


def kernel(envs: int, threads: int) -> Contender:
    """The bare simulator on a schedule: commands in, states out; no goals or observations."""
    model = build_model(load_fish("zheng-2021-a"))
    kernels = model.kernels
    start = start_state(envs)
    commands = drawn_commands((DRAWN, envs))
    record = np.repeat(model.record, envs, axis=1)
    slew, clock = np.full((5, envs), np.inf), np.zeros(envs)

    def run(steps: int) -> None:
        state, inputs = start.copy(), commands[0].copy()
        failed_at = np.full(envs, np.inf)
        for done in range(0, steps, DRAWN):
            kernels.advance(
                state, inputs, record, slew, clock, commands,
                schedule_grid(0, min(DRAWN, steps - done)),
                tables=model.tables, failed_at=failed_at, threads=threads,
            )  # fmt: skip

    name = f"bare simulator, batch {envs}"
    return Contender(name, envs, threads, 0.1, 10, "RK4", run, environment=False)


BUILDERS: list[tuple[str, Callable[[], Contender]]] = [
    ("RoboticFish3D-v0, single", single),
    ("RoboticFish3D-v0, 1024 on one thread", lambda: vector(1024, 1)),
    ("RoboticFish3D-v0, 1024 on two threads", lambda: vector(1024, 2)),
    ("bare simulator, batch 1", lambda: kernel(1, 1)),
    ("bare simulator, batch 1024 on one thread", lambda: kernel(1024, 1)),
    ("bare simulator, batch 1024 on two threads", lambda: kernel(1024, 2)),
]
