"""Other readings of a dataset: what a line of its dataset.yaml would change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.frames import switch_dataset_frame
from fish_env.data.retiming import Clocks, retimed
from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.data.vocabulary import COMMANDS

BOUNDED = {"pitch": 0.5 * math.pi, "roll": math.pi}


@dataclass(frozen=True)
class Column:
    """How a channel or command is read: factor times its source, plus an offset (SI)."""

    source: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Change:
    """Another reading of a dataset.

    Attributes:
        kind: "sign", "unit", "swap", "mirror", "frame", "offset", "clock", "clock_skew",
            "clock_offset" or "beat".
        target: what is read otherwise: columns, or the clock.
        value: the sign, factor, offset or scale; None for a swap or a frame.
        unit: of the value.
        line: what to write into dataset.yaml.
        words: what is wrong, in words.
        channels: columns that are read otherwise.
        commands: commands that are.
        clocks: corrections of the clocks and beats by run; the key "" stands for all others.
        turned: the whole dataset is in the other frame.
    """

    kind: str
    target: str
    value: float | None
    unit: str
    line: str
    words: str
    channels: Mapping[str, Column] = field(default_factory=dict)
    commands: Mapping[str, Column] = field(default_factory=dict)
    clocks: Mapping[str, Clocks] = field(default_factory=dict)
    turned: bool = False

    @property
    def columns(self) -> frozenset[str]:
        """Channels and commands that it reads otherwise."""
        return frozenset([*self.channels, *self.commands])

    def applied(self, dataset: Dataset) -> Dataset:
        """The dataset, read in this way."""
        if self.turned:
            return switch_dataset_frame(dataset)
        runs = tuple(self._run(run) for run in dataset.runs)
        return replace(dataset, runs=runs, noise=self._noise(dataset.noise))

    def _run(self, run: Run) -> Run:
        changed = {name: self._read(run, name, c) for name, c in self.channels.items()}
        steps = run.commands
        if self.commands:
            read = [self.commands.get(name, Column(name)) for name in COMMANDS]
            values = steps.values[:, [list(COMMANDS).index(column.source) for column in read]]
            factors = np.array([column.factor for column in read])
            steps = CommandSteps(steps.times_s, values * factors + 0.0)
        run = replace(run, channels={**run.channels, **changed}, commands=steps)
        return retimed(run, self.clocks.get(run.id, self.clocks.get("", Clocks())))

    @staticmethod
    def _read(run: Run, name: str, column: Column) -> FloatArray:
        values = column.factor * run.channels[column.source] + column.offset
        limit = BOUNDED.get(name)
        # Another unit may leave an angle without a meaning; it is then no angle, but no error.
        return values if limit is None else np.clip(values, -limit, limit)

    def _noise(self, noise: Mapping[str, float]) -> dict[str, float]:
        read = {name: self.channels.get(name, Column(name)) for name in noise}
        return {
            name: abs(c.factor) * noise[c.source] for name, c in read.items() if c.source in noise
        }
