"""Reading of one run's CSV file."""

from dataclasses import replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.attitude import check_quaternion, euler_from_quaternion
from fish_env.data.clock import check_clock, read_time
from fish_env.data.columns import note_ignored, read_commands, read_quantities
from fish_env.data.declared import TIME
from fish_env.data.description import Description, RunEntry
from fish_env.data.frames import switch_tail_phase
from fish_env.data.model_frame import commands_to_model_frame, to_model_frame
from fish_env.data.place import Place
from fish_env.data.plausibility import check_progress, check_rate, check_travel, check_turning
from fish_env.data.retiming import retimed
from fish_env.data.schema import CommandSteps, Run
from fish_env.data.table import Column, Table, read_table
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
    return build_run(description, entry, read_table(Place(entry.file, run=entry.id), fewest_rows=2))


def build_run(
    description: Description, entry: RunEntry, table: Table
) -> tuple[Run, tuple[str, ...]]:
    """Builds a run from the cells of its file; see :func:`read_run`."""
    clock = description.clock
    table = replace(table, columns={**description.columns, TIME: Column(clock.column, 1.0, "ned")})
    used = [TIME, *description.channels, *description.commands]
    table.require(used)
    time, time_notes = read_time(table, clock)
    channels = read_quantities(table, description.channels, FILE_CHANNELS)
    commands, phase = read_commands(table, description), entry.tail_phase
    check_clock(time, commands, clock, table)
    check_turning_channels(time, channels, description.channels, table)
    channels = quaternion_to_angles(channels, table)
    check_positions(time, channels, commands, description.channels, table)
    channels = to_model_frame(channels, description.columns, table.place)
    commands = commands_to_model_frame(commands, description.columns, description.frame)
    if description.frame == "enu":
        phase = switch_tail_phase(phase)
    channels, depth_notes = depth_to_z(channels, table)
    steps = CommandSteps(time, commands)
    run = Run(entry.id, time, channels, steps, entry.start, phase, entry.condition)
    run = retimed(run, entry.clocks)
    notes = (
        *time_notes,
        *note_ignored(table, used),
        *depth_notes,
        *note_late_commands(steps, time, channels, table.place),
    )
    return run, notes


def note_late_commands(
    steps: CommandSteps, time: FloatArray, channels: dict[str, FloatArray], place: Place
) -> tuple[str, ...]:
    """Words a note if commands change after a gap: a lost row takes its command with it.

    Args:
        steps: The commands.
        time: Times of the rows, shape (n,), s.
        channels: What was measured, each of shape (n,). A row without anything in it was added
            for its command, which then is not late.
        place: The file and run.
    """
    present = np.array([np.isfinite(values) for values in channels.values()])
    busiest = time[present[np.argmax(present.sum(axis=1))]]
    usual = np.median(np.diff(busiest if busiest.size > 1 else time))
    switches = np.searchsorted(time, steps.times_s[1:])
    gaps = np.diff(time)[switches - 1]
    anything = np.asarray(present.any(axis=0))[switches]
    late = int(np.sum((gaps > LONG_GAP * usual) & anything))
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
        place = table.at(name)
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
        check_travel(time, values, units[name], table.rows, table.at(name))
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
        raise table.at("depth", table.rows[first]).refuse(
            f"depth and z differ by {np.median(difference[both]):.3g} m (median)",
            "z points down in frame ned and up in frame enu, depth always down; "
            "correct one of the two or leave it out",
        )
    gaps = np.isnan(z)
    note = f"{table.at('depth')}: z is kept; depth fills {gaps.sum()} gaps in it"
    return others | {"z": np.where(gaps, depth, z)}, (note,)
