"""Files that can be replayed: tables of a simulated motion, and runs of a measured dataset."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from fish_env.arrays import FloatArray
from fish_env.data import CHANNELS
from fish_env.data.clock import LONGEST_S
from fish_env.data.description import FILE_NAME, read_description
from fish_env.data.run_file import read_run
from fish_env.data.schema import CommandSteps, Run
from fish_env.data.table import MOST_COLUMNS
from fish_env.errors import DatasetError, missing_extra
from fish_env.files import STANDARD
from fish_env.model.state import INPUTS
from fish_env.reading import (
    MOST_TABLE_BYTES,
    Unreadable,
    located,
    read_bytes,
    read_standard_input,
    short,
    words_of,
)
from fish_env.replay.motion import Motion, Role, motion_from_channels, motion_from_run
from fish_env.trajectory import POSE_COLUMNS

MOST_ROWS = 2_000_000
ROLES: tuple[Role, ...] = ("measured", "baseline", "extended")
QUATERNION = ("qw", "qx", "qy", "qz")


@dataclass(frozen=True, eq=False)
class ReplayFile:
    """What a file holds.

    Attributes:
        motion: To be shown.
        fish: Preset or file of the fish, where the file's dataset names one.
    """

    motion: Motion
    fish: str | None = None


def read_replay_file(
    file: Path, commands: CommandSteps | None = None, tail_phase: float | None = None
) -> ReplayFile:
    """Reads a trajectory, or a run if a dataset.yaml beside the file lists it.

    A file whose name is or ends in ``measured``, ``baseline`` or ``extended`` gets that colour.

    Args:
        file: CSV or Parquet; `-` is CSV from standard input.
        commands: What the actuators were asked, where a trajectory does not hold it.
        tail_phase: Tail phase at the start that goes with them, rad.

    Raises:
        DatasetError: It is no such file; names what is wrong and where.
        MissingExtraError: A Parquet file, but pyarrow is not installed.
    """
    if str(file) == STANDARD:
        return ReplayFile(_trajectory(Path("stdin"), _standard_table(), commands, tail_phase))
    try:
        located(file)
    except Unreadable as error:
        raise DatasetError(f"{error}") from None
    if file.is_dir():
        raise DatasetError(
            f"{file}: a folder; name one of its files, or see all of a dataset with "
            f"`robofish compare {file} --replay page.html`"
        )
    if not file.is_file():
        what = "a pipe or a device, not a file" if file.exists() else "there is no such file"
        raise DatasetError(f"{file}: {what}; name a .csv or .parquet file")
    found = _dataset_run(file)
    if found is not None:
        run, fish = found
        return ReplayFile(motion_from_run(run, run.id), fish)
    return ReplayFile(_trajectory(file, _read_table(file), commands, tail_phase))


def role_of(name: str) -> Role:
    """The role that a name says: its last word, else ``other``."""
    last = name.lower().replace("-", "_").split("_")[-1]
    return next((role for role in ROLES if role == last), "other")


def _dataset_run(file: Path) -> tuple[Run, str] | None:
    """The run of a dataset and its fish, where a dataset.yaml beside the file lists the file."""
    description_file = file.parent / FILE_NAME
    if not description_file.is_file():
        return None
    description = read_description(description_file)
    for entry in description.runs:
        if entry.file.resolve() == file.resolve():
            return read_run(description, entry)[0], description.fish
    return None


def _standard_table() -> pd.DataFrame:
    try:
        return pd.read_csv(io.StringIO(read_standard_input(MOST_TABLE_BYTES)), low_memory=False)
    except Unreadable as error:
        raise DatasetError(f"standard input {error}") from None
    except (ValueError, OverflowError, RecursionError) as error:
        reason = words_of(error)
        raise DatasetError(f"standard input: no CSV table ({reason}); check it") from None


def _read_table(file: Path) -> pd.DataFrame:
    try:
        if file.suffix == ".parquet":
            return pd.read_parquet(file)
        if file.suffix == ".csv":
            content = read_bytes(file, MOST_TABLE_BYTES)
            if content[: content.find(b"\n")].count(b",") > MOST_COLUMNS:
                raise DatasetError(f"{file}: more than {MOST_COLUMNS} columns; leave some out")
            return pd.read_csv(io.BytesIO(content), low_memory=False)
    except ImportError:
        raise missing_extra("Reading Parquet", "pyarrow", "parquet") from None
    except Unreadable as error:
        raise DatasetError(f"{file}: {error}") from None
    except (ValueError, OSError, OverflowError, RecursionError) as error:
        reason = words_of(error)
        raise DatasetError(f"{file}: cannot be read as a table ({reason}); check it") from None
    raise DatasetError(f"{file}: a replay reads .csv and .parquet files, not '{file.suffix}'")


def _trajectory(
    file: Path, table: pd.DataFrame, commands: CommandSteps | None, tail_phase: float | None
) -> Motion:
    known = {"t", *CHANNELS, *QUATERNION, *INPUTS, "tail_phase"}
    if len(table) > MOST_ROWS:
        raise DatasetError(f"{file}: {len(table):,} rows; a replay takes up to {MOST_ROWS:,}")
    columns = {str(name): _numbers(file, table, name) for name in table if str(name) in known}
    _check(file, columns)
    time_s = columns.pop("t")
    channels = {name: values for name, values in columns.items() if name in CHANNELS}
    if set(QUATERNION) <= set(columns):
        channels |= _euler(file, np.column_stack([columns[name] for name in QUATERNION]))
    if {"tail_phase", *INPUTS} <= set(columns):
        commands = CommandSteps(time_s, np.column_stack([columns[name] for name in INPUTS]))
        tail_phase = float(columns["tail_phase"][0])
    name = file.stem
    return motion_from_channels(time_s, channels, name, role_of(name), commands, tail_phase)


def _numbers(file: Path, table: pd.DataFrame, name: object) -> FloatArray:
    cells = table[name]
    try:
        values = pd.to_numeric(cells, errors="coerce").to_numpy(float)
    except (TypeError, ValueError, OverflowError):
        raise DatasetError(f"{file}: column {name} holds no numbers; correct it") from None
    bad = np.flatnonzero((np.isnan(values) & cells.notna().to_numpy()) | np.isinf(values))
    if bad.size:
        cell = short(str(cells.iloc[bad[0]]))
        raise DatasetError(
            f"{file}: row {bad[0] + 2}, column {name}: '{cell}' is not a finite number; correct it"
        )
    return np.asarray(values)


def _check(file: Path, columns: dict[str, FloatArray]) -> None:
    time_s = columns.get("t")
    if time_s is None or not set(POSE_COLUMNS) & set(columns):
        raise DatasetError(
            f"{file}: a trajectory has a column t (s) and columns of pose or velocity "
            f"({', '.join(POSE_COLUMNS)}); a measured run needs its {FILE_NAME} beside it"
        )
    wrong = np.flatnonzero(~(np.diff(time_s) > 0.0))
    if len(time_s) < 2 or wrong.size:
        row = int(wrong[0]) + 3 if wrong.size else 2
        raise DatasetError(f"{file}: row {row}: t must increase, over two rows at least")
    if time_s[-1] - time_s[0] > LONGEST_S:
        raise DatasetError(
            f"{file}: t spans {time_s[-1] - time_s[0]:.4g} s; correct it or its unit"
        )
    empty = [name for name, values in columns.items() if not np.isfinite(values).any()]
    if empty:
        raise DatasetError(f"{file}: no value at all in {', '.join(empty)}; leave out the column")


def _euler(file: Path, quaternion: FloatArray) -> dict[str, FloatArray]:
    if not np.all(np.abs(np.linalg.norm(quaternion, axis=1) - 1.0) < 0.01):
        raise DatasetError(f"{file}: qw qx qy qz must be unit quaternions in every row")
    angles = Rotation.from_quat(quaternion, scalar_first=True).as_euler("ZYX")
    yaw, pitch, roll = angles.T
    return {"roll": np.unwrap(roll), "pitch": pitch, "yaw": np.unwrap(yaw)}
