"""Compiles the kernels that the tests share, several at once, so that no test waits for them.

Run it as ``python -m scripts.warm_kernels``; what is compiled already takes no time.
"""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed

import gymnasium as gym
import numpy as np

import fish_env  # noqa: F401  (registers the environment)
from fish_env.data import Dataset, Run
from fish_env.data.schema import CommandSteps
from fish_env.effects.extended import EffectValues
from fish_env.identification import SeriesProblem, fit
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from fish_env.steady import steady_motion
from tests.hidden.simulate import simulate

FISH = "zheng-2021-a"
SWIM = (0.0, 0.3, 2.0, 0.0, 0.0)
EFFECT: EffectValues = {"servo_lag": {"time_constant": 0.05}}
CORNERS: EffectValues = {"servo_backlash": {"gap": 0.05}}


def one_fish(effects: EffectValues) -> None:
    """Rollouts, derivatives and wrenches of the simulator."""
    simulator = Simulator(FISH, effects=effects)
    run = simulator.run([{"t": 0.0}], duration_s=0.1)
    simulator.state_derivative(run.states[-1])
    simulator.wrench_by_term(run.states[-1])


def many_fish(effects: EffectValues) -> None:
    """Rollouts of a batch."""
    steady_motion(Simulator(FISH, effects=effects).model, [SWIM, SWIM], tolerance=1.0)


def single_environment(effects: EffectValues) -> None:
    """One step of the environment."""
    env = gym.make("RoboticFish3D-v0", effects=effects)
    env.reset(seed=0)
    env.step(env.action_space.sample())


def vector_environment(effects: EffectValues) -> None:
    """One step of many environments."""
    envs = gym.make_vec("RoboticFish3D-v0", num_envs=2, effects=effects)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())


def filters(effects: EffectValues) -> None:
    """The Kalman filter over one short run."""
    run = Simulator(FISH).run(
        [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0}], 2.0, rate_hz=25.0
    )
    channels = {name: run.channels[name] for name in ("x", "y", "z", "yaw")}
    noisy = {n: v + 1e-3 * np.sin(np.arange(len(v)) ** 2) for n, v in channels.items()}
    steps = CommandSteps(run.time_s[:1], run.inputs[:1])
    measured = Run("warm", run.time_s, noisy, steps, "rest", 0.0)
    problem = SeriesProblem(Dataset("warm", FISH, (measured,)), paths=["mass.total"])
    # What a noise model's refit compiles is the same for all effects.
    fit(problem, list(effects), refit_noise=not effects, iterations=1)


def hidden_fish(effects: EffectValues) -> None:
    """The second simulator, which makes measurements for the tests."""
    simulate(load_fish(FISH).values(), np.array([[0.0, *SWIM]]), np.array([0.0, 0.1]), effects)


TASKS: Mapping[str, tuple[Callable[[EffectValues], None], EffectValues]] = {
    "filter, all effects": (filters, EFFECT),
    "filter, no effects": (filters, {}),
    "hidden physics": (hidden_fish, {}),
} | {
    f"{name}, {kind}": (task, effects)
    for kind, effects in (
        ("an effect of the tail", EFFECT),
        ("a tail whose rate jumps", CORNERS),
        ("no effects", {}),
    )
    for name, task in (
        ("vector environment", vector_environment),
        ("environment", single_environment),
        ("batch", many_fish),
        ("simulator", one_fish),
    )
}
"""Name -> what compiles it, the longest first."""


def collect_garbage_rarely() -> None:
    """The compiler keeps what it makes: looking for garbage in it takes a fifteenth of the time."""
    gc.set_threshold(200_000, 50, 1000)


def timed(name: str) -> float:
    """Does one task; returns how long it took (s)."""
    started = time.perf_counter()
    task, effects = TASKS[name]
    task(effects)
    return time.perf_counter() - started


def main() -> None:
    """Compiles everything and says how long each part took."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.processes, initializer=collect_garbage_rarely) as pool:
        jobs = {pool.submit(timed, name): name for name in TASKS}
        for job in as_completed(jobs):
            print(f"{job.result():6.1f} s  {jobs[job]}", flush=True)


if __name__ == "__main__":
    main()
