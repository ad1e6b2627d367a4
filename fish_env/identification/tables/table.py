"""A table of steady motion, arranged by condition."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.schema import SteadyDataset

TURN_RADIUS, CURVATURE = "turn_radius", "curvature"
UNITS = {
    "surge_speed": "m/s",
    "sway_speed": "m/s",
    "heave_speed": "m/s",
    "speed": "m/s",
    "yaw_rate": "rad/s",
    CURVATURE: "1/m",
    "pitch": "rad",
}


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of measured averages and the conditions they belong to.

    Attributes:
        name: of the dataset.
        ids: of the rows.
        conditions: names, C of them.
        commands: shape (C, 5), SI.
        condition_of: which condition each row belongs to, shape (R,).
        observations: names, K of them; a turn radius stands as curvature of the path, which is
            finite on a straight path, too.
        values: shape (R, K), SI, NaN where missing.
        declared: one-sigma noise that the file declares, shape (K,), NaN where it does not.
    """

    name: str
    ids: tuple[str, ...]
    conditions: tuple[str, ...]
    commands: FloatArray
    condition_of: IntArray
    observations: tuple[str, ...]
    values: FloatArray
    declared: FloatArray

    @property
    def present(self) -> BoolArray:
        """Which values were measured, shape (R, K)."""
        return np.isfinite(self.values)

    @cached_property
    def lines(self) -> tuple[IntArray, IntArray, IntArray]:
        """Row, column and condition of every measured value (D,), conditions one after another."""
        row, column = np.nonzero(self.present)
        order = np.argsort(self.condition_of[row], kind="stable")
        return row[order], column[order], self.condition_of[row][order]

    @property
    def counts(self) -> FloatArray:
        """Measured values of each condition, shape (C, K)."""
        counts = np.zeros((len(self.conditions), len(self.observations)))
        np.add.at(counts, self.condition_of, self.present.astype(float))
        return counts

    @property
    def repeats(self) -> int:
        """Measured values beyond the first of each condition: freedom of the repeats' scatter."""
        return int(np.maximum(self.counts - 1.0, 0.0).sum())

    def some(self, conditions: IntArray) -> Table:
        """The rows of some conditions."""
        new = np.full(len(self.conditions), -1)
        new[conditions] = np.arange(len(conditions))
        rows = np.flatnonzero(new[self.condition_of] >= 0)
        return replace(
            self,
            ids=tuple(self.ids[i] for i in rows),
            conditions=tuple(self.conditions[i] for i in conditions),
            commands=self.commands[conditions],
            condition_of=new[self.condition_of[rows]],
            values=self.values[rows],
        )


def table_of(dataset: SteadyDataset) -> Table:
    """Arrange a dataset by condition.

    Rows are repeats when they have the same commands and, where conditions are named, the same
    condition.
    """
    keys = [
        (condition, tuple(row))
        for condition, row in zip(dataset.conditions, dataset.commands.tolist(), strict=True)
    ]
    order = list(dict.fromkeys(keys))
    names = _names([condition for condition, _ in order])
    observations = {n: v for n, v in dataset.observations.items() if n != TURN_RADIUS}
    if TURN_RADIUS in dataset.observations:
        observations[CURVATURE] = 1.0 / np.maximum(dataset.observations[TURN_RADIUS], 1e-3)
    return Table(
        dataset.name,
        dataset.ids,
        names,
        np.array([commands for _, commands in order]),
        np.array([order.index(key) for key in keys]),
        tuple(observations),
        np.column_stack(list(observations.values())),
        np.array([dataset.noise.get(name, np.nan) for name in observations]),
    )


def _names(conditions: list[str | None]) -> tuple[str, ...]:
    """Unique names: those given where they are unique, numbered ones otherwise."""
    unique = [c for c in conditions if c is not None and conditions.count(c) == 1]
    return tuple(
        str(c) if c in unique else f"{c or 'condition'} #{i + 1}" for i, c in enumerate(conditions)
    )
