"""A simulated motion: labelled arrays over time, to tables and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from fish_env.arrays import FloatArray
from fish_env.errors import ScheduleError
from fish_env.model.state import INPUTS
from fish_env.motion_files import write_csv_file, write_parquet_file
from fish_env.sensing.channels import channels_from_states

if TYPE_CHECKING:
    import pandas as pd

POSE_COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz", "u", "v", "w", "p", "q", "r")


@dataclass(frozen=True)
class Trajectory:
    """States of one fish at sample times.

    Attributes:
        time_s: (T,) sample times (s).
        states: (T, states), columns named by ``state_names``; SI, radians.
        state_names: x y z (m, inertial NED), qw qx qy qz (body to inertial), u v w (m/s, body),
            p q r (rad/s, body), tail_phase (rad), running integrals, then states of effects.
        inputs: (T, 5) actuator positions in the order of :data:`fish_env.model.state.INPUTS`.
        fish: name of the fish.
        dt: physics step (s).
    """

    time_s: FloatArray
    states: FloatArray
    state_names: tuple[str, ...]
    inputs: FloatArray
    fish: str
    dt: float

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time_s)

    def __getitem__(self, name: str) -> FloatArray:
        """A column by name: a state, a channel (roll, pitch, yaw) or an input; shape (T,).

        Raises:
            KeyError: no such column; the message lists them.
        """
        columns = self.columns
        if name not in columns:
            raise KeyError(f"'{name}' is not a column of the trajectory: {', '.join(columns)}")
        return columns[name]

    @cached_property
    def channels(self) -> dict[str, FloatArray]:
        """Pose and velocity channels as sensors name them, each (T,); yaw unwrapped."""
        return channels_from_states(self.states.T)

    @cached_property
    def columns(self) -> dict[str, FloatArray]:
        """Everything by name, each (T,), beginning with ``t``."""
        states = {name: self.states[:, i] for i, name in enumerate(self.state_names)}
        inputs = {name: self.inputs[:, i] for i, name in enumerate(INPUTS)}
        return {"t": self.time_s, **states, **self.channels, **inputs}

    def to_pandas(self) -> pd.DataFrame:
        """All columns as a data frame with a plain index."""
        import pandas as pd

        return pd.DataFrame(self.columns)

    def to_csv(self, path: str | Path, columns: tuple[str, ...] | None = None) -> None:
        """Write columns (default: all) as CSV that reads back equal, and beside it their units.

        See :mod:`fish_env.motion_files`.
        """
        write_csv_file(self._chosen(columns), path)

    def to_parquet(self, path: str | Path) -> None:
        """Write all columns as Parquet.

        Raises:
            MissingExtraError: pyarrow is not installed.
        """
        write_parquet_file(self.columns, path)

    def _chosen(self, columns: tuple[str, ...] | None) -> Mapping[str, FloatArray]:
        everything = self.columns
        unknown = [name for name in columns or () if name not in everything]
        if unknown:
            raise ScheduleError(f"no columns {unknown} in the trajectory: {', '.join(everything)}")
        return {name: everything[name] for name in columns or everything}
