"""What dataset.yaml says about the data beside it."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from fish_env.data.declared import TIME, Clock, check_columns, parse_clock, parse_column
from fish_env.data.frames import FRAMES
from fish_env.data.mapping import Section, read_section
from fish_env.data.place import Place, closest
from fish_env.data.plausibility import check_value
from fish_env.data.retiming import Clocks, parse_clocks
from fish_env.data.schema import Start
from fish_env.data.table import Column
from fish_env.data.units import SI_UNIT, Unit
from fish_env.data.vocabulary import (
    CHANNELS,
    COMMANDS,
    FILE_CHANNELS,
    FORMAT,
    OBSERVATIONS,
    QUATERNION,
    Quantity,
)
from fish_env.files import file_name
from fish_env.params import list_fish
from fish_env.reading import short

FILE_NAME = "dataset.yaml"
LONGEST_ID = 100
"""Characters of a run's id, which names files."""
ABOUT = ("description", "source", "licence", "license", "citation", "url", "date", "comment")
"""Keys of free text, kept with the data."""

_COMMON = ("format", "name", "fish", "frame", "channels", "commands")
_OPTIONAL = ("noise", "constant_commands", *ABOUT)
_ATTITUDE = ("roll", "pitch", "yaw")
_PHASE = Quantity("angle", -2.0 * math.pi, 2.0 * math.pi)


@dataclass(frozen=True)
class RunEntry:
    """One entry under `runs`: as `Run`, with the file that holds it and its clocks' corrections."""

    id: str
    file: Path
    start: Start
    tail_phase: float | None
    condition: str | None
    clocks: Clocks = Clocks()


@dataclass(frozen=True)
class Description:
    """The checked content of dataset.yaml.

    Attributes:
        place: The file.
        name: Name of the dataset.
        fish: Name of a shipped fish, or absolute path of a parameter file.
        frame: "ned" or "enu".
        channels: Unit of each declared channel, or observation of a steady table.
        commands: Unit of each command that has a column.
        columns: Where each of these channels and commands stands in the files.
        clock: The time column.
        constants: SI value of each command that has none.
        noise: One-sigma value of channels, SI, in the file's frame.
        runs: The runs; empty for a steady table.
        table: The CSV file of a steady table.
        about: The free text.
    """

    place: Place
    name: str
    fish: str
    frame: str
    channels: dict[str, Unit]
    commands: dict[str, Unit]
    columns: dict[str, Column]
    clock: Clock
    constants: dict[str, float]
    noise: dict[str, float]
    runs: tuple[RunEntry, ...]
    table: Path | None
    about: dict[str, str]


def read_description(file: Path) -> Description:
    """Reads and checks dataset.yaml.

    Raises:
        DatasetError: It is missing or says anything that the format does not know.
    """
    return parse_description(read_section(Place(file)))


def parse_description(top: Section) -> Description:
    """Checks the content of dataset.yaml.

    Raises:
        DatasetError: It says anything that the format does not know.
    """
    top.require(["format"])
    top.choice("format", [FORMAT])
    steady = "kind" in top and top.choice("kind", ["steady"]) == "steady"
    own = ("kind", "file") if steady else ("runs", "time", "clock")
    top.allow([*_COMMON, *_OPTIONAL, *own])
    top.require(_COMMON)
    frame = top.choice("frame", FRAMES)
    known = OBSERVATIONS if steady else FILE_CHANNELS
    channels, columns = _parse_columns(top.section("channels"), known, frame)
    if not steady:
        _check_attitude(channels, columns, top.at("channels"))
    commands, command_columns = _parse_columns(top.section("commands"), COMMANDS, frame, "command")
    columns |= command_columns
    clock = parse_clock(top)
    check_columns(columns, clock, top)
    return Description(
        place=top.place,
        name=top.text("name"),
        fish=_find_fish(top),
        frame=frame,
        channels=channels,
        commands=commands,
        columns=columns,
        clock=clock,
        constants=_parse_constants(top, commands),
        noise=_parse_noise(top.section("noise"), channels),
        runs=() if steady else _parse_runs(top),
        table=_find_table(top) if steady else None,
        about={key: top.text(key) for key in ABOUT if key in top},
    )


def _parse_columns(
    section: Section, known: Mapping[str, Quantity], frame: str, what: str = "channel"
) -> tuple[dict[str, Unit], dict[str, Column]]:
    # `t: s` among the channels tells of the clock.
    times = [TIME] if what == "channel" else []
    section.allow([*known, *times], what)
    units, columns = dict[str, Unit](), dict[str, Column]()
    for name in section:
        if name != TIME:
            units[name], columns[name] = parse_column(section, name, known[name], frame)
    if what == "channel" and not units:
        raise section.place.refuse("no channel is declared", "Declare at least one: `x: m`")
    return units, columns


def _check_attitude(
    channels: Mapping[str, Unit], columns: Mapping[str, Column], place: Place
) -> None:
    given = [name for name in QUATERNION if name in channels]
    if given and len(given) < len(QUATERNION):
        raise place.refuse(
            f"a quaternion needs {', '.join(QUATERNION)}, and only {', '.join(given)} is declared",
            "Declare all four",
        )
    angles = [name for name in _ATTITUDE if name in channels]
    if given and angles:
        raise place.refuse(
            f"the attitude is declared twice, as a quaternion and as {', '.join(angles)}",
            "Declare one of the two",
        )
    if len({columns[name].frame for name in given}) > 1:
        raise place.refuse(
            f"{', '.join(QUATERNION)} are declared in two frames", "Give the four one frame"
        )


def _find_fish(top: Section) -> str:
    name, presets = top.text("fish"), list_fish()
    if name in presets:
        return name
    path = top.path("fish").resolve()
    if not path.is_file():
        raise top.at("fish").refuse(
            f"'{name}' is neither a fish that comes with the package nor the path of a file",
            f"{closest(name, presets)}; a path is relative to {FILE_NAME}",
        )
    return str(path)


def _parse_constants(top: Section, commands: Mapping[str, Unit]) -> dict[str, float]:
    section = top.section("constant_commands")
    section.allow(COMMANDS, "command")
    constants = {}
    for name in section:
        if name in commands:
            raise section.at(name).refuse(
                "the command is also declared as a column", "Keep one of the two"
            )
        constants[name] = section.number(name)
        check_value(constants[name], COMMANDS[name], _si(COMMANDS[name]), section.at(name))
    missing = [name for name in COMMANDS if name not in commands and name not in constants]
    if missing:
        example = ", ".join(f"{name}: 0.0" for name in missing)
        raise top.at("commands").refuse(
            f"not declared: {', '.join(missing)}",
            "Declare their columns, or say what they were held at, in SI units: "
            f"constant_commands: {{{example}}}",
        )
    return constants


def _si(quantity: Quantity) -> Unit:
    return Unit(SI_UNIT[quantity.dimension], 1.0)


def _parse_noise(section: Section, channels: Mapping[str, Unit]) -> dict[str, float]:
    units = dict(channels)
    if "qw" in channels:
        units = {name: unit for name, unit in units.items() if name not in QUATERNION}
        units |= {name: _si(CHANNELS[name]) for name in _ATTITUDE}
    section.allow(units, "channel")
    noise = {}
    for name in section:
        value = section.number(name)
        if value <= 0.0:
            raise section.at(name).refuse(
                f"{value} is not a standard deviation",
                "Give a positive one, or leave it out to estimate it",
            )
        if units[name].name == "rad" and value > 1.0:
            raise section.at(name).refuse(
                f"{value:.6g} rad of noise can only be degrees", "Give it in the channel's unit"
            )
        noise[name] = value * units[name].factor
    return noise


def _parse_runs(top: Section) -> tuple[RunEntry, ...]:
    entries = [_parse_run(item, top) for item in top.items("runs")]
    for what, values in (
        ("id", [file_name(entry.id) for entry in entries]),
        ("file", [str(entry.file.resolve()) for entry in entries]),
    ):
        twice = [value for value, count in Counter(values).items() if count > 1]
        if twice:
            raise top.at("runs").refuse(
                f"two runs have the {what} '{twice[0]}'", f"Give each run its own {what}"
            )
    return tuple(entries)


def _parse_run(item: object, top: Section) -> RunEntry:
    section = Section(item, top.at("runs"))
    section.allow(["id", "file", "start", "tail_phase", "condition", "clock"])
    id = section.text("id")
    if len(id) > LONGEST_ID:
        raise section.at("id").refuse(
            f"the id '{short(id)}' has {len(id)} characters, more than {LONGEST_ID}", "Shorten it"
        )
    section = Section(item, Place(top.place.file, run=id))
    section.require(["file", "start", "tail_phase"])
    return RunEntry(
        id=id,
        file=section.path("file"),
        start=cast(Start, section.choice("start", ["rest", "unknown"])),
        tail_phase=_parse_phase(section),
        condition=section.text("condition") if "condition" in section else None,
        clocks=parse_clocks((section if "clock" in section else top).section("clock")),
    )


def _parse_phase(section: Section) -> float | None:
    if section.text("tail_phase") == "unknown":
        return None
    phase = section.number("tail_phase")
    check_value(phase, _PHASE, _si(_PHASE), section.at("tail_phase"))
    return phase


def _find_table(top: Section) -> Path:
    folder = top.place.file.parent
    if "file" in top:
        return top.path("file")
    tables = sorted(folder.glob("*.csv"))
    if len(tables) != 1:
        raise top.at("file").refuse(
            f"the folder has {len(tables)} CSV files", "Name the table: `file: steady.csv`"
        )
    return tables[0]
