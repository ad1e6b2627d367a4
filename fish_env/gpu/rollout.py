"""Rollouts on the device: many fish through the same schedule, each with its own parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.gpu.arrays import fetch, put, zeros
from fish_env.gpu.compiled import (
    blocks_for,
    check_device,
    real_type,
    rollout_kernel,
    threads_for,
)
from fish_env.model.grid import Grid
from fish_env.model.history import history_rows_on
from fish_env.model.runtime import Kernels


class DeviceRollout:
    """N fish on the device that follow commands; arrays stay there between calls.

    Attributes:
        state: (states, N), rows as ``kernels.state_names``.
        inputs: (5, N) actuator positions.
        failed_at: (N,) time at which a fish diverged (s), infinite where none did.
        trace: (slots, rows, N) samples of the last :meth:`advance`.
    """

    def __init__(
        self,
        kernels: Kernels,
        state: FloatArray,
        inputs: FloatArray,
        par: FloatArray,
        slew: FloatArray,
        tables: FloatArray,
        precision: str = "float32",
    ) -> None:
        """Copy fish to the device.

        Args:
            kernels: the physics.
            state: (states, N) at the start, with the states of effects initialised.
            inputs: (5, N) actuator positions.
            par: (parameters, N) records.
            slew: (5, N) slew limits (per second); infinite = ideal actuator.
            tables: packed coefficient curves.
            precision: ``"float32"`` or ``"float64"``.

        Raises:
            ConfigError: no device, or another precision.
        """
        check_device()
        self.real = real = real_type(precision)
        self._kernels, self._precision = kernels, precision
        self.count = state.shape[1]
        self._delay = kernels.longest_delay(par)
        self.state, self.inputs = put(state, real), put(inputs, real)
        self._par, self._slew = put(par, real), put(slew, real)
        self._tables = put(tables, real)
        self.failed_at = put(np.full(self.count, np.inf), real)
        self.trace = zeros((0, 0, self.count), real)

    def advance(
        self,
        commands: FloatArray,
        grid: Grid,
        *,
        time: float = 0.0,
        trace_row: int = 0,
        trace_rows: int = 0,
    ) -> None:
        """Advance all fish through a grid, in place; nothing is waited for.

        Args:
            commands: (slots, 5, N or 1) targets of the actuators.
            grid: when they hold, and when samples are stored.
            time: at the start (s).
            trace_row: first state row that is stored.
            trace_rows: how many are; 0 stores nothing.
        """
        real = self.real
        slots = int(np.sum(grid.steps // grid.every)) if trace_rows else 0
        self.trace = zeros((slots, trace_rows, self.count), real)
        history = zeros((history_rows_on(grid, self._delay), self.count), real)
        segments = [put(a, np.int64 if a.dtype.kind == "i" else real) for a in grid]
        kernel: Any = rollout_kernel(self._kernels, self._precision, trace_row, trace_rows)
        kernel[blocks_for(self.count), threads_for(self.count)](
            self.state, self.inputs, self._par, self._slew, put(np.full(self.count, time), real),
            put(commands, real), *segments, 0, self.trace, self.failed_at, history, self._tables,
        )  # fmt: skip

    def states(self) -> FloatArray:
        """(states, N), a copy on the host."""
        return fetch(self.state).astype(float)

    def samples(self) -> FloatArray:
        """(slots, rows, N) of the last advance, a copy on the host."""
        return fetch(self.trace).astype(float)
