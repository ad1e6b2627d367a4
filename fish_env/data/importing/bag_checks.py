"""Whether a ROS bag can be read without surprises, before `rosbags` opens it.

`rosbags` makes reading functions from the message definitions in a bag, and asks the database of a
`.db3` file. A definition may be so large that its functions take hours to make, and a database may
compute what it seems to hold.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fish_env.data.importing.limits import check_is_file
from fish_env.data.place import Place
from fish_env.reading import Unreadable
from fish_env.yaml_text import TextLoader, read_yaml

METADATA = "metadata.yaml"
MOST_DEFINITION = 200_000
"""Characters of a message definition, with those of the types in it."""
MOST_FIELDS = 2_000
"""Fields of all types of a topic, and elements of their arrays of fixed length."""
_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_COMPUTED = re.compile(r"\bas\b|\bvirtual\b", re.IGNORECASE)
_NO_TOOL = "Record the bag again; no ROS tool writes this"
_ARRAY, _SEQUENCE = 3, 4
_BASE, _OTHER = 1, 2


def check_bag(path: Path) -> None:
    """Checks what `rosbags` would read of a bag before it has a topic.

    Args:
        path: A file of a bag, or its folder.

    Raises:
        DatasetError: Its metadata are too large, or its database computes its content.
    """
    files = [path]
    if path.is_dir():
        try:
            read_yaml(path / METADATA, TextLoader)
            files = sorted(path.iterdir())
        except (FileNotFoundError, Unreadable) as error:
            reason = error.reason if isinstance(error, Unreadable) else "it is missing"
            raise Place(path / METADATA).refuse(reason, "Record the bag again") from None
    for file in files:
        if file.suffix == ".db3":
            _check_database(file)


def _check_database(file: Path) -> None:
    """Refuses a database with views, triggers or computed columns: reading them is computing."""
    place = Place(file)
    check_is_file(file)
    if set("?#%") & set(str(file.absolute())):
        raise place.refuse(
            "the library that reads bags cannot open paths with ?, # or %", "Rename the file"
        )
    found: list[tuple[str, str | None]] = []
    with suppress(sqlite3.Error):  # what is no database is refused by who reads it
        uri = f"file:{quote(str(file.absolute()))}?mode=ro&immutable=1"
        with closing(sqlite3.connect(uri, uri=True)) as database:
            found = list(database.execute("SELECT type, sql FROM sqlite_master LIMIT 1000"))
    for kind, statement in found:
        if kind not in ("table", "index") or _COMPUTED.search(statement or ""):
            raise place.refuse(f"its database has a computed table or column ({kind})", _NO_TOOL)


def check_definition(path: Path, kind: str, text: str) -> None:
    """Refuses a message definition that takes too long to parse.

    Args:
        path: The bag.
        kind: Name of the message type.
        text: The definition.

    Raises:
        DatasetError: It is too long.
    """
    if len(text) > MOST_DEFINITION:
        raise Place(path).refuse(
            f"the definition of {kind[:60]!r} has {len(text):,} characters",
            "Record the bag without that topic",
        )


def check_types(path: Path, types: Mapping[str, Any]) -> None:
    """Refuses message types whose names are none, or that are too large or hold themselves.

    Args:
        path: The bag.
        types: Constants and fields by type, as rosbags parsed them.

    Raises:
        DatasetError: Naming the first that is wrong.
    """
    for kind, (constants, fields) in types.items():
        names = [kind, *(field[0] for field in fields), *(constant[0] for constant in constants)]
        names += [name for field in fields for name in _named_types(field[1])]
        wrong = next((name for name in names if not _NAME.fullmatch(str(name))), None)
        if wrong is not None:
            raise Place(path).refuse(
                f"the message type {kind[:60]!r} uses {str(wrong)[:60]!r} as a name", _NO_TOOL
            )
    size = sum(_size(field[1]) for _, fields in types.values() for field in fields)
    if size > MOST_FIELDS:
        raise Place(path).refuse(
            f"a message has {size} fields and elements of arrays of fixed length, more than "
            f"{MOST_FIELDS}",
            "Record the bag without that topic",
        )


def _size(description: Any) -> int:
    """A field, or as many as an array of fixed length has; arrays of numbers are one."""
    node, detail = description
    if int(node) != _ARRAY or (int(detail[0][0]) == _BASE and detail[0][1][0] != "string"):
        return 1
    return max(1, int(detail[1]))


def _named_types(description: Any) -> list[str]:
    """Types that a field refers to by name."""
    node, detail = description
    if int(node) == _OTHER:
        return [detail]
    return _named_types(detail[0]) if int(node) in (_ARRAY, _SEQUENCE) else []
