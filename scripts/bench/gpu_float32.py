"""Errors of float32: the functions of the GPU, compiled for the CPU, against the float64 kernels.

    python -m scripts.bench.gpu_float32      # minutes; writes results/gpu-float32-<date>.json

No GPU takes part. The functions and the types of their numbers are those of the GPU; its compiler
may join multiplications and additions otherwise.
"""

from __future__ import annotations

import argparse
from typing import Any

import numba
import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.batch import BatchShape, FishBatch
from fish_env.envs.layout import OUTPUTS
from fish_env.envs.options import EnvOptions, env_options
from fish_env.gpu import compiled
from fish_env.gpu.target import Target
from scripts.results import RESULTS, write_dated

FISH, STEPS, HELD = 256, 400, 5
"""Fish, control steps, and control steps that an action is held for."""
TOLD_AT = (1, 10, 50, 100, 200, 400)
FAILURE = OUTPUTS.index("failure")


class HostTarget(Target):
    """Compiles for the CPU what a target compiles for a GPU."""

    def _compile(self, function: Any, **_: Any) -> Any:
        decorate: Any = numba.njit
        return decorate(error_model="numpy")(function)

    def entry(self, function: Any) -> Any:
        """A function that Python calls."""
        return self._compile(self._retyped(function))


def step_all(
    work, data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring, ring_at, noise,
    obs, setup, history, tables,
):  # fmt: skip
    """One control step of every fish, as the kernel ``step`` of a GPU takes it."""
    for lane in range(data.shape[1]):
        step_block(  # noqa: F821
            work, 1, data, actions, queue, queue_at, slots, starts, steps, sizes, every, ring,
            ring_at, noise, obs, setup, SUBSTEPS, BACK, TRACE_ROW, history, tables, lane, 1,  # noqa: F821
        )  # fmt: skip


class Single:
    """A batch in float32, which goes on from one in float64."""

    def __init__(self, options: EnvOptions, batch: FishBatch) -> None:
        original, compiled.Target = compiled.Target, HostTarget  # type: ignore[misc]
        try:
            shape = BatchShape.of(options)
            constants = {
                "SUBSTEPS": options.config.substeps,
                "BACK": options.observation_lag,
                "TRACE_ROW": shape.trace_row,
                "TRACE_ROWS": shape.ring_rows,
            }
            target: Any = compiled._target(batch._rows, np.float32, constants)
        finally:
            compiled.Target = original  # type: ignore[misc]
        self._step = target.entry(step_all)
        saved = batch.save_state()["arrays"]
        self.data, self._queue, self._ring, self._noise = (
            single(saved[name]) for name in ("_data", "_queue", "_ring", "_noise")
        )
        self._places, self._substeps = [0, 0], options.config.substeps
        self._grid = [a if a.dtype.kind == "i" else single(a) for a in shape.grid]
        self._fixed = [single(options.config.setup(options.task)), np.zeros((0, batch.count))]
        self._fixed = [*map(single, self._fixed), single(options.model.tables)]
        self._work = single(np.zeros(batch._rows.WORK_ROWS))
        self.obs = np.zeros(batch.obs.shape, np.float32)

    def step(self, actions: Any) -> None:
        """One control step of all fish."""
        self._step(
            self._work, self.data, actions, self._queue, self._places[0], *self._grid, self._ring,
            self._places[1], self._noise, self.obs, *self._fixed,
        )  # fmt: skip
        slots = len(self._queue), len(self._ring)
        self._places = [
            (place + step) % count
            for place, step, count in zip(self._places, (1, self._substeps), slots, strict=True)
        ]


def single(array: Any) -> Any:
    """The array in float32."""
    return np.ascontiguousarray(array, np.float32)


def compared(seed: int) -> dict[str, Any]:
    """Differences of both batches over an episode of random actions."""
    options = env_options()
    batch = FishBatch(options, FISH)
    batch.reset(np.arange(FISH), [np.random.default_rng(seed + i) for i in range(FISH)])
    ours, rows = Single(options, batch), batch._rows
    random = np.random.default_rng(seed)
    middle = random.uniform(-0.5, 0.5, (FISH, 5))
    returns, told = np.zeros((2, FISH)), []
    for step in range(STEPS):
        if step % HELD == 0:
            actions = single(middle + 0.3 * random.standard_normal((FISH, 5)))
        batch.step(actions)
        ours.step(actions)
        returns += batch.reward, ours.data[rows.ROW_REWARD]
        if step + 1 in TOLD_AT:
            told.append({"control_steps": step + 1, **differences(ours, batch)})
    apart = np.abs(returns[0] - returns[1])
    return {
        "differences": told,
        "return": {"mean": float(returns[0].mean()), "largest_difference": float(apart.max())},
        "failed": float((batch.outputs[FAILURE] > 0).mean()),
    }


def differences(ours: Single, batch: FishBatch) -> dict[str, float]:
    """Largest differences of any fish, in SI units."""

    def apart(first: int, last: int) -> FloatArray:
        return np.abs(ours.data[first:last] - batch.state[first:last]).max(axis=0)

    return {
        "position_m": float(apart(0, 3).max()),
        "position_m_median": float(np.median(apart(0, 3))),
        "quaternion": float(apart(3, 7).max()),
        "velocity_m_per_s": float(apart(7, 10).max()),
        "observation": float(np.abs(ours.obs - batch.obs).max()),
    }


def main(argv: list[str] | None = None) -> None:
    """Compare, print, write."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.gpu_float32")
    parser.add_argument("--dry", action="store_true", help="write nothing")
    options = parser.parse_args(argv)
    content = {
        "command": "python -m scripts.bench.gpu_float32",
        "about": "functions of the GPU in float32, compiled for the CPU, against float64",
        "fish": FISH,
        **compared(seed=0),
    }
    print(content)
    if not options.dry:
        print(f"written: {write_dated(RESULTS, 'gpu-float32', content)}")


if __name__ == "__main__":
    main()
