"""Corrections of a guessed mapping, in the words of the mapping itself."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

from fish_env.data.importing.plan import Content, fish_path
from fish_env.data.mapping import parse_section
from fish_env.data.place import Place, closest
from fish_env.data.vocabulary import COMMANDS, FILE_CHANNELS

NOTHING = "none"
KEYS = ("name", "fish", "frame", "start", "tail_phase", "run_column")
SECTIONS = ("channels", "commands", "constant_commands", "sources")
"""Keys of a mapping whose entries may be named with or without them."""


def corrected(content: Content, text: str, columns: Collection[str] = ()) -> Content:
    """Changes a mapping as one line says.

    `yaw: deg` or `yaw: {unit: deg, sign: -1}` changes a channel or command, `yaw: none` takes it
    out, `yaw: psi` takes another column, `tail_offset: 0` makes a command constant, `frame: enu`
    changes the dataset, and `pose: {time: {unit: ms}}` changes a source. Messages name entries with
    their section, `constant_commands: {tail_offset: 0}`: that is understood too.

    Args:
        content: The mapping.
        text: The line, YAML.
        columns: Names of the columns of the logs.

    Returns:
        The changed mapping; the given one is left as it is.

    Raises:
        DatasetError: The line is no YAML, or names nothing of a mapping.
    """
    section = parse_section(text, Place(Path("correction")))
    sources = content["sources"]
    entries = dict[str, Any]()
    for key, value in section.content.items():
        entries |= value if key in SECTIONS and isinstance(value, dict) else {key: value}
    for key, value in entries.items():
        if key in FILE_CHANNELS or key in COMMANDS:
            content = _with_entry(content, key, value, columns)
        elif key in sources:
            content = {**content, "sources": {**sources, key: _merged(sources[key], value)}}
        elif key in KEYS:
            content = {k: v for k, v in content.items() if k != key}
            content |= {} if value == NOTHING else {key: _resolved(key, value)}
        else:
            known = [*FILE_CHANNELS, *COMMANDS, *KEYS, *sources]
            raise section.at(key).refuse(f"'{key}' is not known", closest(key, known))
    return content


def _resolved(key: str, value: Any) -> Any:
    if key != "fish" or not isinstance(value, str):
        return value
    return fish_path(value, Place(Path("correction")))


def _with_entry(content: Content, name: str, value: Any, columns: Collection[str]) -> Content:
    group = "commands" if name in COMMANDS else "channels"
    entries = dict(content.get(group, {}))
    constants = dict(content.get("constant_commands", {}))
    constants.pop(name, None)
    old = entries.pop(name, {})
    if group == "commands" and _is_number(value):
        constants[name] = float(value)
    elif value != NOTHING:
        if isinstance(value, str):
            value = {"column" if value in columns else "unit": value}
        entries[name] = _merged(old, value)
    return {**content, group: entries, "constant_commands": constants}


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def _merged(old: Any, new: Any) -> Any:
    if not (isinstance(old, dict) and isinstance(new, dict)):
        return new
    return {**old, **{key: _merged(old.get(key), value) for key, value in new.items()}}
