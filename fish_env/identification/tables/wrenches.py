"""Forces and moments of no particular origin: functions of the commands times a held wrench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.identification.generic_forces import DIRECTIONS, probes


@dataclass(frozen=True, eq=False)
class HeldWrenches:
    """Generic terms of the adequacy test of a table.

    Column 6 * function + direction is one wrench.

    Attributes:
        commands: of the conditions, shape (C, 5).
        respond: change of the residuals (N, D) by wrenches (6, C, N) that stay.
    """

    commands: FloatArray
    respond: Callable[[FloatArray], FloatArray]

    @cached_property
    def functions(self) -> dict[str, FloatArray]:
        """Functions of the commands, each (C,), with a root mean square of one."""
        return functions(self.commands)

    @property
    def columns(self) -> IntArray:
        """Every wrench there is (6 J,)."""
        return np.arange(6 * len(self.functions))

    def words(self, column: int) -> tuple[str, str]:
        """Function and direction of a wrench."""
        return list(self.functions)[column // 6], DIRECTIONS[column % 6]

    def swings(self, column: int) -> bool:
        """No wrench swings: each is constant in a condition."""
        return False

    def unit(self, column: int) -> float:
        """Root mean square (N or N m) of the wrench behind one unit of :meth:`changes`."""
        return float(probes(np.array([column]))[0])

    def changes(self, columns: IntArray) -> FloatArray:
        """How :func:`probes` of some wrenches change the residuals (D, N)."""
        table = np.array(list(self.functions.values()))
        wrench = np.zeros((6, table.shape[1], len(columns)))
        for i, column in enumerate(columns.tolist()):
            wrench[column % 6, :, i] = self.unit(column) * table[column // 6]
        return self.respond(wrench).T


def functions(commands: FloatArray) -> dict[str, FloatArray]:
    """Functions of the commands (C, 5), each (C,), with a root mean square of one."""
    of = dict(zip(COMMANDS, commands.T, strict=True))
    offset, amplitude, frequency = (of[f"tail_{n}"] for n in ("offset", "amplitude", "frequency"))
    beat = amplitude * frequency
    plain = {"constant": np.ones_like(offset), "beat speed^2": beat**2}
    varied = {
        "offset": offset,
        "|offset|": np.abs(offset),
        "offset^2": offset**2,
        "amplitude": amplitude,
        "frequency": frequency,
        "offset beat^2": offset * beat**2,
        "|offset| beat^2": np.abs(offset) * beat**2,
        "block": of["block_displacement"],
        "bracket": of["block_angle"],
    }
    plain |= {name: v for name, v in varied.items() if np.ptp(v) > 1e-9}
    return {name: v / np.sqrt(np.mean(v**2)) for name, v in plain.items() if np.mean(v**2) > 1e-18}
