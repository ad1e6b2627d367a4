"""What the columns of some logs mean: the mapping, as a person writes it and as it is used.

A mapping is YAML. It names the tables (`sources`), and for each channel and command the table,
the column, its unit and, where needed, sign, scale and frame.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from fish_env.data.declared import parse_column
from fish_env.data.frames import FRAMES
from fish_env.data.importing.stamps import TimeColumn
from fish_env.data.mapping import Section, parse_section, read_section
from fish_env.data.place import Place, closest
from fish_env.data.table import Column
from fish_env.data.units import Unit
from fish_env.data.vocabulary import COMMANDS, FILE_CHANNELS, Quantity
from fish_env.params import list_fish
from fish_env.reading import Unreadable, located, plain_number

FORMAT = "robofish-import/1"
BETWEEN = ("hold", "linear")
"""What a command is between its rows: the last one, or on a straight line to the next."""

Content = dict[str, Any]
"""A mapping as YAML holds it."""


@dataclass(frozen=True)
class SourceSpec:
    """Which tables are one source.

    Attributes:
        files: Pattern of the names of their files.
        part: Pattern of topic, sheet or variable; empty for a file that is one table.
        time: Their time column.
    """

    files: str
    part: str
    time: TimeColumn


@dataclass(frozen=True)
class Entry:
    """Where one channel or command comes from.

    Attributes:
        source: Name of the source.
        unit: Unit of its values after sign and scale.
        column: Column, factor and frame.
        between: For a command, one of `BETWEEN`.
    """

    source: str
    unit: Unit
    column: Column
    between: str = "hold"


@dataclass(frozen=True)
class RunSpec:
    """What is told of one run: its files, and whatever dataset.yaml says of a run."""

    id: str
    files: tuple[str, ...]
    about: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """A checked mapping.

    Attributes:
        content: The mapping as YAML holds it, for writing.
        sources: The tables by name.
        channels: Where each channel comes from.
        commands: Where each command comes from that is not constant.
        run_column: Column that tells the runs in one table apart, or None.
        runs: What is told of single runs; empty where files tell the runs apart.
    """

    content: Content
    sources: Mapping[str, SourceSpec]
    channels: Mapping[str, Entry]
    commands: Mapping[str, Entry]
    run_column: str | None
    runs: tuple[RunSpec, ...]


def parse_plan(content: Content, file: Path) -> Plan:
    """Checks a mapping.

    Args:
        content: The mapping as YAML holds it.
        file: Where it stands, for errors.

    Raises:
        DatasetError: It says anything unknown, or leaves out what is needed.
    """
    top = parse_section(plan_text(content), Place(file))
    top.require(["format", "name", "fish", "frame", "sources", "channels"])
    top.choice("format", [FORMAT])
    top.allow(
        [
            "format",
            "name",
            "fish",
            "frame",
            "start",
            "tail_phase",
            "run_column",
            "sources",
            "channels",
            "commands",
            "constant_commands",
            "noise",
            "runs",
        ]
    )
    frame = top.choice("frame", FRAMES)
    if not list(top.section("channels")):
        raise top.at("channels").refuse(
            "no channel is mapped", "Map at least one: x: {source: ..., column: ..., unit: m}"
        )
    sources = {
        name: _source(top.section("sources").section(name)) for name in top.section("sources")
    }
    return Plan(
        content=content,
        sources=sources,
        channels=_entries(top.section("channels"), FILE_CHANNELS, frame, sources, "channel"),
        commands=_entries(top.section("commands"), COMMANDS, frame, sources, "command"),
        run_column=top.text("run_column") if "run_column" in top else None,
        runs=_runs(top) if "runs" in top else (),
    )


def used_sources(plan: Plan) -> tuple[str, ...]:
    """Names of the sources that a channel or a command comes from."""
    entries = (*plan.channels.values(), *plan.commands.values())
    return tuple(dict.fromkeys(entry.source for entry in entries))


def plan_text(content: Content) -> str:
    """The mapping as YAML."""
    return yaml.dump(
        _with_numbers(content), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100
    )


def _with_numbers(content: Any) -> Any:
    """Numbers in place of their text, as reading leaves them, where a number is meant."""
    if isinstance(content, list):
        return [_with_numbers(item) for item in content]
    if not isinstance(content, dict):
        return content
    numbers = {"sign", "scale", "offset", *COMMANDS}
    return {
        key: _number(value) if key in numbers and isinstance(value, str) else _with_numbers(value)
        for key, value in content.items()
    }


def _number(text: str) -> float | int | str:
    """The number that a text is; a text that is none stays, for the reader to refuse."""
    value = plain_number(text)
    if not math.isfinite(value):
        return text
    return int(value) if value.is_integer() and text.strip().lstrip("+-").isdigit() else value


class _Dumper(yaml.SafeDumper):
    """Writes the innermost sections on one line each."""

    def represent_mapping(self, tag: Any, mapping: Any, flow_style: Any = None) -> Any:
        node = super().represent_mapping(tag, mapping, flow_style)
        plain = all(not isinstance(value, dict | list) for value in dict(mapping).values())
        node.flow_style = plain and not any(key == "format" for key in dict(mapping))
        return node

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _source(section: Section) -> SourceSpec:
    section.allow(["files", "part", "time"])
    section.require(["time"])
    time = section.section("time")
    time.allow(["column", "unit", "offset"])
    return SourceSpec(
        files=section.text("files") if "files" in section else "*",
        part=section.text("part") if "part" in section else "",
        time=TimeColumn(
            time.text("column"),
            time.text("unit"),
            time.number("offset") if "offset" in time else 0.0,
        ),
    )


def _entries(
    section: Section,
    known: Mapping[str, Quantity],
    frame: str,
    sources: Mapping[str, SourceSpec],
    what: str,
) -> dict[str, Entry]:
    section.allow(known, what)
    return {name: _entry(section, name, known[name], frame, sources, what) for name in section}


def _entry(
    section: Section,
    name: str,
    quantity: Quantity,
    frame: str,
    sources: Mapping[str, SourceSpec],
    what: str,
) -> Entry:
    own = section.section(name)
    if "source" in own:
        source = own.text("source")
        if source not in sources:
            raise own.at("source").refuse(f"no source '{source}'", closest(source, sources))
    elif len(sources) == 1:
        source = next(iter(sources))
    else:
        raise own.at("source").refuse("the source is missing", f"Name one of: {', '.join(sources)}")
    between = own.choice("between", BETWEEN) if "between" in own and what == "command" else "hold"
    other = ("source", "between") if what == "command" else ("source",)
    bare = {key: value for key, value in own.content.items() if key not in other}
    unit, column = parse_column(Section({name: bare}, section.place), name, quantity, frame)
    return Entry(source, unit, column, between)


def _runs(top: Section) -> tuple[RunSpec, ...]:
    specs = []
    for item in top.items("runs"):
        section = Section(item, top.at("runs"))
        section.allow(["id", "files", "start", "tail_phase", "condition"])
        files = section.items("files")
        about = {
            key: section.text(key) for key in ("start", "tail_phase", "condition") if key in section
        }
        specs.append(RunSpec(section.text("id"), tuple(str(f) for f in files), about))
    return tuple(specs)


def read_content(file: Path) -> Content:
    """Reads a mapping file, which options may complete before it is checked.

    The path of a fish file in it is relative to the mapping.

    Raises:
        DatasetError: It is missing or no YAML mapping.
    """
    section = read_section(Place(file))
    content = section.content
    if isinstance(fish := content.get("fish"), str) and fish not in list_fish():
        content["fish"] = str(section.path("fish").resolve())
    return content


def fish_path(fish: str, place: Place) -> str:
    """A fish as a mapping names it: a preset, or the whole path of a file.

    Args:
        fish: Preset, or path relative to the working folder.
        place: Who names it, for errors.

    Raises:
        DatasetError: No path can be so named.
    """
    if fish in list_fish():
        return fish
    try:
        return str(located(fish).resolve())
    except Unreadable as error:
        raise place.unreadable(error, "fish: ") from None
