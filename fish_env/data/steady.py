"""Reading of a table of steady motion: commands, and the speeds and rates they led to."""

from dataclasses import replace
from pathlib import Path

from fish_env.data.columns import note_ignored, read_commands, read_quantities
from fish_env.data.description import Description
from fish_env.data.model_frame import commands_to_model_frame, to_model_frame
from fish_env.data.place import Place
from fish_env.data.plausibility import check_rate
from fish_env.data.schema import SteadyDataset
from fish_env.data.table import Table, read_table
from fish_env.data.vocabulary import OBSERVATIONS

ID, CONDITION = "id", "condition"


def read_steady(description: Description, file: Path) -> SteadyDataset:
    """Reads a table of steady motion into SI units and the model's frame.

    Two columns of text may stand in it: `id` names the rows, which are numbered by their line of
    the file otherwise; `condition` names what repeats of one experiment share.

    Args:
        description: What dataset.yaml says about it.
        file: The CSV file.

    Raises:
        DatasetError: The file is not what is declared.
    """
    table = replace(read_table(Place(file), fewest_rows=1), columns=description.columns)
    columns = [*description.channels, *description.commands]
    table.require(columns)
    observations = read_quantities(table, description.channels, OBSERVATIONS)
    if "yaw_rate" in observations:
        place, unit = table.at("yaw_rate"), description.channels["yaw_rate"]
        check_rate(observations["yaw_rate"], unit, table.rows, place)
    commands = read_commands(table, description)
    observations = to_model_frame(observations, description.columns, table.place)
    commands = commands_to_model_frame(commands, description.columns, description.frame)
    return SteadyDataset(
        name=description.name,
        fish=description.fish,
        ids=_read_ids(table),
        conditions=_read_conditions(table),
        commands=commands,
        observations=observations,
        noise=description.noise,
        about=description.about,
        notes=_notes(description, table, [*columns, ID, CONDITION]),
    )


def _read_ids(table: Table) -> tuple[str, ...]:
    if ID not in table.cells:
        return tuple(str(row) for row in table.rows)
    ids = table.text(ID)
    for row, id in zip(table.rows, ids, strict=True):
        if ids.count(id) > 1:
            raise table.place.at(row, ID).refuse(
                f"two rows have the id '{id}'", "Give each row its own id"
            )
    return ids


def _read_conditions(table: Table) -> tuple[str | None, ...]:
    if CONDITION not in table.cells:
        return (None,) * len(table.rows)
    return tuple(str(cell).strip() or None for cell in table.cells[CONDITION])


def _notes(description: Description, table: Table, used: list[str]) -> tuple[str, ...]:
    notes = note_ignored(table, used)
    if description.frame == "enu":
        notes = (f"{description.place}: converted from frame enu to ned", *notes)
    return notes
