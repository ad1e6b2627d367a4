"""The environments this one is measured against, each as its own project runs it."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from scripts.bench.harness import Contender
from scripts.bench.ours import DRAWN, drawn_actions

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
"""MuJoCo's, in the order of its option."""
ENVPOOL_BYTES = 13_000_000
"""Memory that EnvPool takes for one environment."""


def swimmer() -> Contender:
    """Gymnasium's three-link Swimmer-v5 (planar), made and wrapped by ``gymnasium.make``."""
    import gymnasium as gym

    try:
        env = gym.make("Swimmer-v5")
    except gym.error.DependencyNotInstalled as error:
        raise ImportError(str(error)) from error
    env.reset(seed=0)
    actions = drawn_actions(env.action_space.shape)

    def run(steps: int) -> None:
        for i in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[i % DRAWN])
            if terminated or truncated:
                env.reset()

    model = env.unwrapped
    integrator = INTEGRATORS[model.model.opt.integrator]
    return Contender(
        "Gymnasium Swimmer-v5, gym.make", 1, 1, model.dt, model.frame_skip, integrator, run
    )


def dm_control_fish() -> Contender:
    """The fish of the dm_control suite, task swim."""
    os.environ.setdefault("MUJOCO_GL", "disable")
    from dm_control import suite

    env = suite.load("fish", "swim", task_kwargs={"random": 0})
    actions = drawn_actions(env.action_spec().shape)
    env.reset()

    def run(steps: int) -> None:
        for i in range(steps):
            if env.step(actions[i % DRAWN]).last():
                env.reset()

    period, dt = env.control_timestep(), env.physics.timestep()
    integrator = INTEGRATORS[env.physics.model.opt.integrator]
    return Contender("dm_control fish-swim", 1, 1, period, round(period / dt), integrator, run)


def envpool_fish(envs: int, batch: int, threads: int) -> Contender:
    """EnvPool's C++ copy of fish-swim; with ``batch < envs`` the asynchronous loop it advises."""
    import envpool

    needed, free = envs * ENVPOOL_BYTES, os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if 1.25 * needed > free:
        raise MemoryError(f"needs {needed / 1e9:.0f} GB of memory, {free / 1e9:.0f} GB are free")

    env = envpool.make(
        "FishSwim-v1", env_type="gymnasium", num_envs=envs, batch_size=batch,
        num_threads=threads, seed=0,
    )  # fmt: skip
    actions = drawn_actions((batch, 5)).astype(np.float64)
    env.async_reset()
    in_flight = envs // batch
    idle: list[np.ndarray] = []

    def run(steps: int) -> None:
        """Nothing is left running when this returns: the clock must see all the work."""
        for ids in idle:
            env.send(actions[0], ids)
        idle.clear()
        for i in range(steps):
            ids = env.recv()[4]["env_id"]
            if i < steps - in_flight:
                env.send(actions[i % DRAWN], ids)
            else:
                idle.append(ids)

    substeps = int(env.spec.config.frame_skip)
    mode = "" if batch == envs else f", {batch} at a time"
    name = f"EnvPool FishSwim-v1, {envs}{mode}"
    return Contender(name, batch, threads, 0.004 * substeps, substeps, "Euler", run)


def rotorpy(envs: int, threads: int) -> Contender:
    """RotorPy's batched quadrotor: a rigid body with aerodynamic drag, written with PyTorch."""
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # idle threads must not slow the others
    import torch
    from rotorpy.learning.quadrotor_environments import QuadrotorEnv

    def full(*row: float) -> torch.Tensor:
        return torch.tensor(row, dtype=torch.float64).repeat(envs, 1)

    start = {name: full(0.0, 0.0, 0.0) for name in ("x", "v", "w", "wind")}
    start |= {"q": full(0.0, 0.0, 0.0, 1.0), "rotor_speeds": full(*[1788.53] * 4)}
    env = QuadrotorEnv(envs, initial_states=start, control_mode="cmd_motor_speeds")
    env.reset(seed=0)
    actions = drawn_actions((envs, 4))[:16]

    def run(steps: int) -> None:
        torch.set_num_threads(threads)
        for i in range(steps):
            env.step(actions[i % len(actions)])

    return Contender(f"RotorPy quadrotor, {envs}", envs, threads, env.t_step, 1, "RK4", run)


def _envpool(envs: int, batch: int, threads: int) -> tuple[str, Callable[[], Contender]]:
    name = f"EnvPool FishSwim-v1, {envs} by {batch} on {threads} threads"
    return name, lambda: envpool_fish(envs, batch, threads)


def _rotorpy(envs: int, threads: int = 1) -> tuple[str, Callable[[], Contender]]:
    return f"RotorPy, {envs} on {threads} threads", lambda: rotorpy(envs, threads)


BUILDERS: list[tuple[str, Callable[[], Contender]]] = [
    ("Gymnasium Swimmer-v5", swimmer),
    ("dm_control fish-swim", dm_control_fish),
    _envpool(1, 1, 1),
    _envpool(64, 64, 1),
    _envpool(64, 64, 2),
    _envpool(128, 64, 2),
    _envpool(1024, 1024, 2),
    _rotorpy(1),
    _rotorpy(64),
    _rotorpy(512),
    _rotorpy(4096),
    _rotorpy(4096, 2),
]
