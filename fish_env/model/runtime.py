"""Runs a composed kernel: whole batches over both cores, derivatives, wrenches by term."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np

from fish_env.arrays import FloatArray
from fish_env.model import compose
from fish_env.model.composition import Composition
from fish_env.model.emit import OUTPUTS
from fish_env.model.grid import Grid
from fish_env.model.history import history_rows_on
from fish_env.model.state import BASE_STATES
from fish_env.threads import default_threads

NO_TRACE = np.zeros((0, 0, 0))


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="fish")


if hasattr(os, "register_at_fork"):
    # Threads do not survive a fork: a child that kept the pool would wait for them forever.
    os.register_at_fork(after_in_child=_pool.cache_clear)


def run_in_threads(task: Callable[[int, int], int], count: int, lanes: int, threads: int) -> int:
    """Call ``task(first, last)`` on slices of a batch, at least eight blocks of lanes each.

    Slices end on block boundaries, so the bits do not depend on the number of threads.

    Returns:
        Sum of what the calls return.
    """
    blocks = -(-count // lanes)
    parts = max(1, min(threads, blocks // 8))
    if parts == 1:
        return task(0, count)
    edges = [min(count, lanes * (blocks * i // parts)) for i in range(parts + 1)]
    pool = _pool(threads)
    jobs = [pool.submit(task, edges[i], edges[i + 1]) for i in range(1, parts)]
    return task(edges[0], edges[1]) + sum(job.result() for job in jobs)


class Kernels:
    """Compiled entry points of one composition.

    Attributes:
        composition: which effects are in.
        state_names: rows of state arrays.
        parameter_names: rows of record arrays.
    """

    def __init__(self, composition: Composition) -> None:
        self.composition = composition
        self.module: ModuleType = compose.load(composition)
        self.state_names = composition.state_names
        self.parameter_names = composition.parameter_names
        self.lanes: int = self.module.LANES

    def __reduce__(self) -> tuple[Callable[[Composition], Kernels], tuple[Composition]]:
        """Machine code is not pickled; the composition finds it again."""
        return kernels, (self.composition,)

    def advance(
        self,
        state: FloatArray,
        inputs: FloatArray,
        par: FloatArray,
        slew: FloatArray,
        time: FloatArray,
        commands: FloatArray,
        grid: Grid,
        *,
        tables: FloatArray,
        failed_at: FloatArray,
        trace: FloatArray = NO_TRACE,
        trace_row: int = 0,
        trace_at: int = 0,
        threads: int | None = None,
        history: FloatArray | None = None,
    ) -> None:
        """Advance all fish in place; arguments as in ``rollout_template.advance_lanes``.

        Without ``history``, what tails were told is remembered within this call alone: before it,
        each is taken to have been told the first command all along. Pass an array of zeros of
        ``history_rows`` rows to carry it from call to call.
        """
        count = state.shape[1]
        if history is None:
            history = np.zeros((history_rows_on(grid, self.longest_delay(par)), count))
        name = "advance_one" if count == 1 else "advance_lanes"
        function = self.entry(name)

        def task(first: int, last: int) -> int:
            function(
                state, inputs, par, slew, time, commands, *grid, trace_row, trace_at, trace,
                failed_at, history, tables, first, last, self.scratch(),
            )  # fmt: skip
            return 0

        run_in_threads(task, count, self.lanes, threads or default_threads())

    def longest_delay(self, par: FloatArray) -> float:
        """How late the latest tail command of these records (parameters, N) is (s)."""
        rows = [self.parameter_names.index(name) for name in self.composition.delays]
        return float(np.max(par[rows].sum(axis=0), initial=0.0))

    def scratch(self) -> FloatArray:
        """Room for one block of fish, at the start of a cache line, as vector registers like it."""
        size = self.module.WORK_ROWS * self.lanes
        room = np.empty(size + 8)
        first = -room.ctypes.data // 8 % 8
        return room[first : first + size]

    def derivative(
        self,
        state: FloatArray,
        inputs: FloatArray,
        rates: FloatArray,
        par: FloatArray,
        time: FloatArray,
        tables: FloatArray,
    ) -> FloatArray:
        """d(state)/dt, shape (states, N), at actuator positions and rates (5, N).

        Rows of memory, which is not integrated, are zero.
        """
        work = self._work(state, inputs, rates, par, time)
        self.entry("derivative_batch")(work, state.shape[1], tables)
        return self._rows(work, self.module.DX, state.shape[1])

    def terms(
        self,
        state: FloatArray,
        inputs: FloatArray,
        rates: FloatArray,
        par: FloatArray,
        time: FloatArray,
        tables: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Wrench of each term and the outputs beside them.

        Returns:
            Wrenches (terms, 6, N) in N and N m about O_b, body frame, in the order of the
            composition's ``term_names``; outputs (len(OUTPUTS), N).
        """
        count = state.shape[1]
        work = self._work(state, inputs, rates, par, time)
        wrenches = np.zeros((self.module.N_TERMS, 6, count))
        outputs = np.zeros((len(OUTPUTS), count))
        self.entry("terms_batch")(work, count, wrenches, outputs, tables)
        return wrenches, outputs

    def initialise(
        self, state: FloatArray, inputs: FloatArray, par: FloatArray, time: FloatArray
    ) -> None:
        """Set the effect states where the start of a run leaves them, in place."""
        if len(self.state_names) == len(BASE_STATES):
            return
        work = self._work(state, inputs, np.zeros_like(inputs), par, time)
        self.entry("initialise_batch")(work, state.shape[1])
        state[:] = self._rows(work, self.module.X, state.shape[1])

    def _work(
        self,
        state: FloatArray,
        inputs: FloatArray,
        rates: FloatArray,
        par: FloatArray,
        time: FloatArray,
    ) -> FloatArray:
        module, count = self.module, state.shape[1]
        work = np.zeros((module.WORK_ROWS, count))
        work[module.X : module.X + module.N_STATES] = state
        work[module.U : module.U + 5] = inputs
        work[module.U_RATE : module.U_RATE + 5] = rates
        work[module.TIME] = time
        work[module.PAR :] = par
        return work.reshape(-1)

    def _rows(self, work: FloatArray, row: int, count: int) -> FloatArray:
        return work.reshape(-1, count)[row : row + self.module.N_STATES].copy()

    def entry(self, name: str) -> Callable[..., Any]:
        """A compiled entry point; says so on stderr when it has to be compiled first."""
        function: Callable[..., Any] = getattr(self.module, name)
        announce_compilation(function, Path(str(self.module.__file__)), name)
        return function


def announce_compilation(function: Any, file: Path, name: str) -> None:
    """Tell the user, once for a machine, that a kernel is being compiled."""
    if getattr(function, "signatures", True) or numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return
    marker = file.with_suffix(f".{name}.compiled")
    if marker.exists():
        return
    print(
        f"fish_env: compiling {name} for this machine "
        f"(once; up to a minute, kept in {file.parent})",
        file=sys.stderr,
        flush=True,
    )
    with suppress(OSError):  # what cannot be kept is said elsewhere
        marker.touch()


@cache
def kernels(composition: Composition) -> Kernels:
    """Kernels of a composition, loaded once in a process."""
    return Kernels(composition)
