"""Columns of a CSV file turned into checked SI arrays, for both forms of dataset."""

from collections.abc import Iterable, Mapping

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.description import Description
from fish_env.data.plausibility import check_range
from fish_env.data.table import Table
from fish_env.data.units import Unit
from fish_env.data.vocabulary import COMMANDS, Quantity


def read_quantity(
    table: Table, name: str, unit: Unit, quantity: Quantity, may_miss: bool = True
) -> FloatArray:
    """Reads one column into SI, shape (n,), NaN where it may be and is missing.

    Raises:
        DatasetError: A cell is no finite number or out of range, or no cell holds anything.
    """
    values = table.numbers(name, may_miss) * unit.factor
    place = table.at(name)
    if np.isnan(values).all():
        raise place.refuse("no row has a value", "Leave the column out of dataset.yaml")
    check_range(values, quantity, unit, table.rows, place)
    return values


def read_quantities(
    table: Table, units: Mapping[str, Unit], known: Mapping[str, Quantity]
) -> dict[str, FloatArray]:
    """Reads every declared column of channels or observations into SI.

    Raises:
        DatasetError: As for `read_quantity`.
    """
    return {name: read_quantity(table, name, unit, known[name]) for name, unit in units.items()}


def read_commands(table: Table, description: Description) -> FloatArray:
    """Reads the commands of every row, constants filled in, shape (n, 5), SI, file's frame.

    Raises:
        DatasetError: As for `read_quantity`; or a cell is empty; or the file has a column of a
            command that dataset.yaml holds constant.
    """
    commands = np.empty((len(table.rows), len(COMMANDS)))
    for column, (name, quantity) in enumerate(COMMANDS.items()):
        if name in description.commands:
            unit = description.commands[name]
            commands[:, column] = read_quantity(table, name, unit, quantity, may_miss=False)
        elif name in table.cells:
            raise table.place.at(1, name).refuse(
                "the command has a column here but is under constant_commands in dataset.yaml",
                "Declare its unit under commands instead, or remove the column",
            )
        else:
            commands[:, column] = description.constants[name]
    return commands


def note_ignored(table: Table, used: Iterable[str]) -> tuple[str, ...]:
    """Words a note for each column of the file that holds no quantity of dataset.yaml."""
    columns = {table.label(name) for name in used}
    ignored = [name for name in table.cells if name not in columns]
    return tuple(f"{table.place.at(column=name)}: not declared, ignored" for name in ignored)
