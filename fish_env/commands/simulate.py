"""`robofish simulate`: one case in, one table out."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console

from fish_env.arrays import FloatArray
from fish_env.commands.case import Case, read_case
from fish_env.commands.numbers import write_json
from fish_env.errors import EffectError, ScheduleError, SimulationDiverged
from fish_env.files import STANDARD, cannot_write, check_outputs
from fish_env.motion_files import (
    check_description,
    description_file,
    write_csv,
    write_csv_file,
    write_parquet_file,
)
from fish_env.params import fish_files
from fish_env.simulator import Simulator
from fish_env.trajectory import POSE_COLUMNS, Trajectory

COLUMNS = ("t", *POSE_COLUMNS)
SUFFIXES = (".csv", ".parquet")


def simulate_case(
    case_file: Path,
    dt: float,
    rate_hz: float,
    out: Path | None,
    replay: Path | None = None,
    trust_effects: bool = False,
    json_file: Path | None = None,
) -> None:
    """Simulates a case and writes its motion, to standard output if no file is named.

    Args:
        case_file: The case, see :mod:`fish_env.commands.case`.
        dt: Longest physics step, s.
        rate_hz: Samples per second.
        out: `.csv` file, described beside it, or `.parquet` file; `-` is standard output.
        replay: HTML page that shows the fish swim.
        trust_effects: Run the effect files that the fish's file names.
        json_file: JSON file of the table by columns; `-` puts it in the place of the table.

    Raises:
        ScheduleError: The case or the output's ending is not as it should be.
        OutputError: An output would replace a file that is read, or cannot be written.
    """
    out = None if out is not None and str(out) == STANDARD else out
    if out is not None and out.suffix not in SUFFIXES:
        raise ScheduleError(f"{out}: give the output the ending .csv or .parquet")
    case = read_case(case_file, trust_effects)
    described = None if out is None or out.suffix != ".csv" else description_file(out)
    check_outputs([out, described, replay, json_file], [case_file, *fish_files(case.fish)])
    if out is not None and described is not None:
        check_description(out)
    trajectory = _simulated(case, case_file, dt, rate_hz)
    table = pose_table(trajectory)
    if out is not None or json_file is None or str(json_file) != STANDARD:
        write_table(table, out)
    if json_file is not None:
        write_json(Console(stderr=True), json_file, {"fish": case.fish.name, "columns": table})
    if replay is not None:
        from fish_env.commands.replay import replay_case

        # Standard output may be the table.
        replay_case(Console(stderr=True), case, dt, case_file.stem, replay)


def _simulated(case: Case, case_file: Path, dt: float, rate_hz: float) -> Trajectory:
    """The motion of a case; errors about the case name its file."""
    try:
        simulator = Simulator(case.fish, dt, case.effects)
    except EffectError as error:
        raise EffectError(f"{case_file}: {error}") from error
    try:
        return simulator.run(case.commands, case.duration_s, case.initial, rate_hz)
    except (ScheduleError, SimulationDiverged) as error:
        raise ScheduleError(f"{case_file}: {error}") from error


def pose_table(trajectory: Trajectory) -> dict[str, FloatArray]:
    """Time, pose and velocities by the names of `COLUMNS`, each (T,).

    q and -q are one attitude; the one with qw >= 0 is given.
    """
    table = np.column_stack([trajectory[name] for name in COLUMNS])
    quaternion = slice(COLUMNS.index("qw"), COLUMNS.index("qz") + 1)
    table[table[:, quaternion.start] < 0.0, quaternion] *= -1.0
    return dict(zip(COLUMNS, table.T + 0.0, strict=True))  # turns -0 into 0


def write_table(columns: Mapping[str, FloatArray], out: Path | None) -> None:
    """Writes columns with all digits, as the file's ending says, or as CSV to standard output."""
    if out is not None:
        (write_parquet_file if out.suffix == ".parquet" else write_csv_file)(columns, out)
        return
    try:
        write_csv(columns, sys.stdout)
        sys.stdout.flush()
    except OSError as error:
        raise cannot_write("standard output", error) from error
