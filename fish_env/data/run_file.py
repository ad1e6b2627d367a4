"""Reading of one run's CSV file."""

import numpy as np

from fish_env.data.attitude import check_quaternion, euler_from_quaternion
from fish_env.data.columns import note_ignored, read_commands, read_quantities
from fish_env.data.description import Description, RunEntry
from fish_env.data.frames import switch_command_frame, switch_frame, switch_tail_phase
from fish_env.data.place import Place
from fish_env.data.plausibility import check_progress, check_rate, check_travel, check_turning
from fish_env.data.schema import CommandSteps, FloatArray, Run
from fish_env.data.table import Table, read_table
from fish_env.data.units import Unit
from fish_env.data.vocabulary import COMMANDS, FILE_CHANNELS, QUATERNION

POSITION = ("x", "y", "z", "depth")
LONG_GAP = 1.8
"""Usual sample intervals. In a longer one a row is missing."""
DEPTH_TOLERANCE = 0.05
"""m. Two sensors of one depth may differ by their offsets, but not by more."""


def read_run(description: Description, entry: RunEntry) -> tuple[Run, tuple[str, ...]]:
    """Reads a run into SI units and the model's frame.

    Args:
        description: The dataset it belongs to.
        entry: Its entry in dataset.yaml.

    Returns:
        The run, and notes of what was ignored or converted.

    Raises:
        DatasetError: The file is not what is declared.
    """
    table = read_table(Place(entry.file, run=entry.id), fewest_rows=2)
    used = ["t", *description.channels, *description.commands]
    table.require(used)
    time = read_time(table)
    channels = read_quantities(table, description.channels, FILE_CHANNELS)
    check_turning_channels(time, channels, description.channels, table)
    channels = quaternion_to_angles(channels, table)
    commands, phase = read_commands(table, description), entry.tail_phase
    check_positions(time, channels, commands, description.channels, table)
    if description.frame == "enu":
        channels = switch_frame(channels)
        commands, phase = switch_command_frame(commands), switch_tail_phase(phase)
    channels, depth_notes = depth_to_z(channels, table)
    steps = CommandSteps(time, commands)
    run = Run(entry.id, time, channels, steps, entry.start, phase, entry.condition)
    notes = (
        *note_ignored(table, used),
        *depth_notes,
        *note_late_commands(steps, time, table.place),
    )
    return run, notes


def read_time(table: Table) -> FloatArray:
    """Reads the time column, shape (n,), s.

    Raises:
        DatasetError: A time is missing, or not later than the one before.
    """
    time = table.numbers("t", may_miss=False)
    backward = np.flatnonzero(np.diff(time) <= 0.0)
    if backward.size:
        before, after = time[backward[0]], time[backward[0] + 1]
        raise table.place.at(table.rows[backward[0] + 1], "t").refuse(
            f"time does not increase: {after:.9g} s comes after {before:.9g} s",
            "Sort the rows or remove the repeated one; if the clock was set back, correct it or "
            "make two runs of it",
        )
    return time


def note_late_commands(steps: CommandSteps, time: FloatArray, place: Place) -> tuple[str, ...]:
    """Words a note if commands change after a gap: a lost row takes its command with it."""
    switches = np.searchsorted(time, steps.times_s[1:])
    gaps = np.diff(time)
    late = int(np.sum(gaps[switches - 1] > LONG_GAP * np.median(gaps)))
    if not late:
        return ()
    return (
        f"{place}: {late} of {len(switches)} changes of command follow a gap, and may really have "
        "come earlier; keep the rows in which a command changes, their channels may be empty",
    )


def check_turning_channels(
    time: FloatArray, channels: dict[str, FloatArray], units: dict[str, Unit], table: Table
) -> None:
    """Refuses a yaw and angular rates whose radians can only be degrees."""
    for name, values in channels.items():
        place = table.place.at(column=name)
        if name == "yaw":
            check_turning(time, values, units[name], table.rows, place)
        elif FILE_CHANNELS[name].dimension == "rate":
            check_rate(values, units[name], table.rows, place)


def check_positions(
    time: FloatArray,
    channels: dict[str, FloatArray],
    commands: FloatArray,
    units: dict[str, Unit],
    table: Table,
) -> None:
    """Refuses positions whose unit can only be another."""
    positions = {name: values for name, values in channels.items() if name in POSITION}
    for name, values in positions.items():
        check_travel(time, values, units[name], table.rows, table.place.at(column=name))
    amplitude = commands[:-1, list(COMMANDS).index("tail_amplitude")]
    beating = float(np.sum(np.diff(time)[amplitude > 0.0]))
    check_progress(beating, positions, units, table.place)


def quaternion_to_angles(channels: dict[str, FloatArray], table: Table) -> dict[str, FloatArray]:
    """Replaces a measured quaternion by roll, pitch and yaw in the same frame."""
    if "qw" not in channels:
        return channels
    quaternion = np.column_stack([channels[name] for name in QUATERNION])
    check_quaternion(quaternion, table.rows, table.place)
    angles = dict(zip(("roll", "pitch", "yaw"), euler_from_quaternion(quaternion).T, strict=True))
    return {name: a for name, a in channels.items() if name not in QUATERNION} | angles


def depth_to_z(
    channels: dict[str, FloatArray], table: Table
) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """Reads a depth as z, which it is in the model's frame.

    Where both are measured they must agree; z is then kept, and depth fills its gaps.

    Args:
        channels: SI, in the model's frame.
        table: The file they are from.

    Returns:
        The channels without depth, and a note if both were measured.

    Raises:
        DatasetError: The two contradict each other.
    """
    if "depth" not in channels:
        return channels, ()
    others = {name: values for name, values in channels.items() if name != "depth"}
    depth = channels["depth"]
    if "z" not in channels:
        return others | {"z": depth}, ()
    z = channels["z"]
    difference = np.abs(z - depth)
    both = np.isfinite(difference)
    if both.any() and np.median(difference[both]) > DEPTH_TOLERANCE:
        first = int(np.argmax(difference > DEPTH_TOLERANCE))
        raise table.place.at(table.rows[first], "depth").refuse(
            f"depth and z differ by {np.median(difference[both]):.3g} m (median)",
            "z points down in frame ned and up in frame enu, depth always down; "
            "correct one of the two or leave it out",
        )
    gaps = np.isnan(z)
    note = f"{table.place.at(column='depth')}: z is kept; depth fills {gaps.sum()} gaps in it"
    return others | {"z": np.where(gaps, depth, z)}, (note,)
