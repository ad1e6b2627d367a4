"""The CUDA kernels of one environment, or of rollouts of one composition."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from fish_env.envs.batch import BatchShape, step_kernels
from fish_env.envs.options import EnvOptions
from fish_env.envs.start import FLOW
from fish_env.errors import ConfigError
from fish_env.gpu import loops
from fish_env.gpu.arithmetic import FLOAT32
from fish_env.gpu.arrays import available
from fish_env.gpu.goals import TASK_NUMBERS
from fish_env.gpu.target import SIMULATED, Target
from fish_env.model.runtime import Kernels

# Of a few fish there is nothing else to launch.
warnings.filterwarnings("ignore", message="Grid size .* under-utilization")
THREADS = 128
"""Threads of a block."""
REGISTERS = 255
"""A fish in registers needs nearly all that a thread can have."""


def real_type(precision: str) -> type[Any]:
    """The type of the numbers.

    Raises:
        ConfigError: another name than ``"float32"`` and ``"float64"``.
    """
    if precision not in ("float32", "float64"):
        raise ConfigError(f"precision '{precision}': 'float32' or 'float64'")
    return np.float32 if precision == "float32" else np.float64


def check_device() -> None:
    """Make sure that there is a device.

    Raises:
        ConfigError: there is none; says what to do.
    """
    if not available():
        raise ConfigError(
            "no CUDA GPU can be used: on a machine with an NVIDIA GPU and its driver, run "
            '`pip install ".[gpu]"` in the clone; on the CPU use gymnasium.make_vec'
        )


def blocks_for(count: int) -> int:
    """Blocks of threads for so many fish."""
    return -(-count // threads_for(count))


def threads_for(count: int) -> int:
    """Threads of a block; the simulator starts each thread of a block, however many are needed."""
    return min(THREADS, count) if SIMULATED else THREADS


def _target(module: ModuleType, real: type[Any], further: Mapping[str, Any]) -> Target:
    replacements: dict[Any, Any] = {module.advance_block: loops.advance_fish}
    if real is np.float32:
        replacements |= FLOAT32
    return Target(real, replacements, vars(module) | {"REAL": real} | dict(further))


class EnvironmentKernels(NamedTuple):
    """CUDA kernels of an environment; each is compiled at its first launch.

    Attributes:
        step: a control step of every fish.
        finish: what follows a step.
        reset: starts episodes.
        count_step: advances the counters that all fish share.
        module: the composed module, which says where rows are.
    """

    step: Any
    finish: Any
    reset: Any
    count_step: Any
    module: ModuleType


def environment_kernels(options: EnvOptions, precision: str, mode: int) -> EnvironmentKernels:
    """The CUDA kernels of an environment; environments of one kind share them.

    Args:
        options: the environment.
        precision: of its numbers, ``"float32"`` or ``"float64"``.
        mode: when episodes are started anew (see :mod:`fish_env.gpu.loops`).
    """
    shape = BatchShape.of(options)
    flow = [options.model.row_of(path) for path in FLOW]
    return kernels_of(
        step_kernels(options).module,
        precision,
        BACK=options.observation_lag,
        FLOW_EAST_ROW=-1 if flow[1] is None else flow[1],
        FLOW_NORTH_ROW=-1 if flow[0] is None else flow[0],
        MODE=mode,
        SUBSTEPS=options.config.substeps,
        TASK=TASK_NUMBERS[options.task],
        TRACE_ROW=shape.trace_row,
        TRACE_ROWS=shape.ring_rows,
    )


@cache
def kernels_of(module: ModuleType, precision: str, **constants: int) -> EnvironmentKernels:
    """The CUDA kernels of a composed module, in which these names are constants."""
    target = _target(module, real_type(precision), constants)
    return EnvironmentKernels(
        step=target.launched(loops.step, max_registers=REGISTERS),
        finish=target.launched(loops.finish),
        reset=target.launched(loops.reset),
        count_step=target.launched(loops.count_step),
        module=module,
    )


@cache
def rollout_kernel(kernels: Kernels, precision: str, trace_row: int, trace_rows: int) -> Any:
    """The CUDA kernel of rollouts that store these rows of the state."""
    constants = {"TRACE_ROW": trace_row, "TRACE_ROWS": trace_rows}
    target = _target(kernels.module, real_type(precision), constants)
    return target.launched(loops.rollout, max_registers=REGISTERS)
