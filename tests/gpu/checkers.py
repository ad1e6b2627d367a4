"""Hold the device to the CPU. Each raises AssertionError where the two differ."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fish_env.envs import start
from fish_env.envs.batch import FishBatch
from fish_env.envs.options import EnvOptions, env_options
from fish_env.gpu.batch import DeviceBatch
from fish_env.gpu.rollout import DeviceRollout
from fish_env.simulator import Simulator, schedule, time_grid

TOLERANCE = 1e-10
FISH = "zheng-2021-a"


class Given:
    """A generator of random numbers that are given."""

    def __init__(self, numbers: np.ndarray) -> None:
        self.numbers = numbers

    def random(self, count: int) -> np.ndarray:
        return self.numbers[:count]

    def integers(self, _: int) -> int:
        return 1


def uniforms(options: EnvOptions, count: int, seed: int = 0) -> np.ndarray:
    """Uniform numbers (numbers, N) for the start of so many fish."""
    return np.random.default_rng(seed).random((start.draw_count(options), count))


def started(options: EnvOptions, draws: np.ndarray) -> FishBatch:
    """A batch on the CPU that starts from these numbers."""
    batch = FishBatch(options, draws.shape[1], threads=1)
    restart(batch, np.arange(draws.shape[1]), draws)
    return batch


def restart(batch: FishBatch, lanes: np.ndarray, draws: np.ndarray) -> None:
    """Start fish of a batch anew from columns of these numbers."""
    rngs: list[Any] = [Given(draws[:, lane]) for lane in lanes]
    batch.reset(lanes, rngs)


def difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference, relative where numbers are above one; NaN where one is infinite."""
    assert ours.shape == theirs.shape
    apart = np.zeros(ours.shape)
    other = ours != theirs
    apart[other] = np.abs(ours[other] - theirs[other]) / np.maximum(1.0, np.abs(theirs[other]))
    return float(np.max(apart, initial=0.0))


def check_alike(device: DeviceBatch, batch: FishBatch, tolerance: float = TOLERANCE) -> None:
    """All numbers of all fish, and what they observe."""
    apart = difference(device.data().astype(float), batch._data)
    assert apart <= tolerance, f"data differ by {apart:g}"
    seen = difference(device.obs.copy_to_host().astype(float), batch.obs.astype(float))
    assert seen <= max(tolerance, 1e-6), f"observations differ by {seen:g}"


def check_environment(
    steps: int = 8,
    count: int = 3,
    precision: str = "float64",
    tolerance: float = TOLERANCE,
    **options: Any,
) -> None:
    """Start and steps of the environment, from the same uniform numbers and actions."""
    made = env_options(**options)
    draws = uniforms(made, count)
    batch = started(made, draws)
    device = DeviceBatch(made, count, precision=precision, autoreset="disabled")
    device.reset(draws=draws)
    check_alike(device, batch, tolerance)
    random = np.random.default_rng(1)
    for _ in range(steps):
        actions = random.uniform(-1.3, 1.3, (count, 5)).astype(np.float32)
        batch.step(actions)
        device.actions.copy_to_device(actions)
        device.step()
        check_alike(device, batch, tolerance)


def check_rollout(effects: dict[str, dict[str, float]], tolerance: float = TOLERANCE) -> None:
    """A rollout of two unlike fish with every tenth state stored."""
    simulator = Simulator(FISH, 0.01, effects=effects)
    model, kernels = simulator.model, simulator.model.kernels
    commands = schedule(
        [
            {"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 2.0, "block_angle": 0.3},
            {"t": 0.13, "tail_amplitude": 0.1, "tail_frequency": 1.0, "block_displacement": 0.01},
        ]
    )
    grid, begins = time_grid(np.arange(5) / 10, commands.times_s, 0.01)
    par = model.records({"tail.area": np.array([0.9, 1.2]) * model.fish.get("tail.area")})
    slew = np.full((5, 2), math.inf)
    slew[1] = 1.5
    state = np.zeros((len(kernels.state_names), 2))
    state[2], state[3], state[7], state[13] = 0.5, 1.0, (0.05, 0.2), (0.0, 2.0)
    inputs = np.repeat(commands.at([0.0]).T, 2, axis=1)
    kernels.initialise(state, inputs, par, np.zeros(2))
    targets = commands.at(begins)[:, :, None].copy()
    device = DeviceRollout(kernels, state, inputs, par, slew, model.tables, "float64")
    device.advance(targets, grid, trace_rows=len(state))
    trace = np.empty((4, *state.shape))
    kernels.advance(
        state, inputs, par, slew, np.zeros(2), targets, grid,
        tables=model.tables, failed_at=np.full(2, math.inf), trace=trace, threads=1,
    )  # fmt: skip
    assert difference(device.states(), state) <= tolerance
    assert difference(device.samples(), trace) <= tolerance
