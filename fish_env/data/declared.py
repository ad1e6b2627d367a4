"""Where the quantities of a dataset stand in its files: columns, signs, scales and clocks."""

from dataclasses import dataclass

from fish_env.data.frames import FRAMES
from fish_env.data.mapping import Section
from fish_env.data.table import Column
from fish_env.data.units import Unit, parse_unit
from fish_env.data.vocabulary import Quantity
from fish_env.reading import short

TIME = "t"
ISO = "iso"
"""Unit of a time column that holds dates and times of day as text (ISO 8601)."""

_DURATION = Quantity("time")


@dataclass(frozen=True)
class Clock:
    """The time column.

    Attributes:
        column: Name of the column in the file.
        unit: Its unit; None where it holds ISO 8601 text.
        declared: Whether dataset.yaml names the unit, rather than leaving it at seconds.
    """

    column: str = TIME
    unit: Unit | None = Unit("s", 1.0)
    declared: bool = False


def parse_column(
    section: Section, name: str, quantity: Quantity, frame: str
) -> tuple[Unit, Column]:
    """Reads how one quantity is declared: by its unit alone, or as a section.

    A section has `unit` and, where they differ from the usual, `column`, `sign`, `scale`, `offset`
    (added last, in the unit) and `frame`.

    Args:
        section: `channels` or `commands` of dataset.yaml.
        name: The quantity.
        quantity: What it measures.
        frame: The frame of the dataset.

    Raises:
        DatasetError: Something in it is unknown, missing or impossible.
    """
    if not section.holds_section(name):
        unit = parse_unit(section.text(name), quantity, section.at(name))
        return unit, Column(name, 1.0, frame)
    declared = section.section(name)
    declared.allow(["column", "sign", "scale", "offset", "unit", "frame"])
    column = declared.text("column") if "column" in declared else name
    unit = parse_unit(declared.text("unit"), quantity, declared.at("unit"))
    own_frame = declared.choice("frame", FRAMES) if "frame" in declared else frame
    offset = declared.number("offset") if "offset" in declared else 0.0
    return unit, Column(column, _parse_factor(declared), own_frame, offset)


def _parse_factor(declared: Section) -> float:
    factor = 1.0
    if "sign" in declared:
        sign = declared.number("sign")
        if abs(sign) != 1.0:
            raise declared.at("sign").refuse(
                f"{sign:g} is no sign", "Use 1 or -1; a factor belongs under `scale`"
            )
        factor *= sign
    if "scale" in declared:
        scale = declared.number("scale")
        if scale == 0.0:
            raise declared.at("scale").refuse("a scale of 0 leaves nothing", "Correct it")
        factor *= scale
    return factor


def parse_clock(top: Section) -> Clock:
    """Reads `time` of dataset.yaml, a section with `column` and `unit`; both may be left out.

    `t: s` under `channels` says the same of the column t.

    Raises:
        DatasetError: Something in it is unknown or no unit of time.
    """
    if "time" not in top:
        channels = top.section("channels")
        if TIME not in channels:
            return Clock()
        unit = parse_unit(channels.text(TIME), _DURATION, channels.at(TIME))
        return Clock(TIME, unit, declared=True)
    if isinstance(column := top.content["time"], str):
        raise top.at("time").refuse(
            f"'{short(column)}' alone does not give the unit",
            f"Write it as {{column: {short(column)}, unit: s}}, with the unit of your clock",
        )
    section = top.section("time")
    section.allow(["column", "unit"])
    column = section.text("column") if "column" in section else TIME
    if "unit" not in section:
        return Clock(column)
    text = section.text("unit")
    if text.lower() == ISO:
        return Clock(column, None, declared=True)
    return Clock(column, parse_unit(text, _DURATION, section.at("unit")), declared=True)


def check_columns(columns: dict[str, Column], clock: Clock, top: Section) -> None:
    """Refuses two quantities that are read from one column.

    Raises:
        DatasetError: Naming the column and both quantities.
    """
    read = {clock.column: "the time"}
    for name, column in columns.items():
        if column.name in read:
            raise top.place.refuse(
                f"{name} and {read[column.name]} are both read from the column '{column.name}'",
                "Give each its own column",
            )
        read[column.name] = name
