"""Reading files that others wrote: no hang, no unbounded memory, one line for each fault.

Every reader of the package goes through :func:`read_bytes` or :func:`read_text`, every YAML file
through :mod:`fish_env.yaml_text`, every JSON file through :func:`read_json`. They raise
:class:`Unreadable`, which a reader words as an error of its own with the place at fault.
"""

from __future__ import annotations

import json
import math
import os
import reprlib
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

MOST_TEXT_BYTES = 1_000_000
"""Of a YAML or JSON file; the largest that this package writes has a tenth of it."""
MOST_TABLE_BYTES = 100_000_000
"""Of a table: some two million rows, which take up to 3 GB of memory."""
DEEPEST = 40
"""Levels of nesting; the deepest file of this package has six."""
LONGEST_SHOWN = 60
LONGEST_REASON = 120
LARGEST = sys.float_info.max
_PAGE = 65_536
_NO_FILE = "is a pipe or a device, not a file"
_REPR = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = LONGEST_SHOWN


class Unreadable(Exception):
    """Raised for a file that cannot be read.

    Attributes:
        reason: What is wrong with it.
        remedy: What to change.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason, remedy)
        self.reason = reason
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.reason}; {self.remedy}"


def shown(value: Any, most: int = LONGEST_SHOWN) -> str:
    """Returns a value as one short line for a message.

    Args:
        value: Anything, such as what a file says.
        most: Characters from which it is cut.
    """
    try:
        # repr would write out all of a long text or list before it is cut.
        text = repr(value[:most]) if isinstance(value, str) else reprlib.Repr.repr(_REPR, value)
    except ValueError:  # an integer of thousands of digits
        text = "a number of thousands of digits"
    return short(text, most + 2)


def short(text: str, most: int = LONGEST_SHOWN) -> str:
    """Returns a text, cut where it is too long for a message.

    Args:
        text: Anything.
        most: Characters from which it is cut.
    """
    return text if len(text) <= most else f"{text[: most - 3]}..."


def printable(text: str) -> str:
    """Returns a text on one line, control characters and lone surrogates as escapes.

    Args:
        text: Anything, such as a name in a file.
    """
    line = " ".join(text.split())
    if line.isprintable():
        return line
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in line
    )


def words_of(error: BaseException, most: int = LONGEST_REASON) -> str:
    """Returns what an error of a library says, on one line that a message can hold.

    Args:
        error: The error.
        most: Characters from which it is cut.
    """
    return short(printable(str(error)), most)


def printable_lines(text: str) -> bool:
    """Whether a text holds no control characters but line ends and tabs, nor lone surrogates.

    Args:
        text: Anything, such as a name in a file.
    """
    return all(c.isprintable() or c in "\n\t" for c in text)


def is_number(value: Any) -> bool:
    """Whether a value is a finite number (a bool is not).

    Args:
        value: Anything.
    """
    numeric = isinstance(value, (int, float, np.integer, np.floating))
    return numeric and not isinstance(value, bool) and bool(-LARGEST <= value <= LARGEST)


def plain_number(text: str) -> float:
    """Reads a number as CSV files and people write it, NaN if it is none.

    Python also reads `1_000` and digits of other scripts, which most programs do not.

    Args:
        text: Such as `-1.5e-3`, `inf` or `nan`.
    """
    try:
        return float(text) if "_" not in text and text.isascii() else math.nan
    except ValueError:
        return math.nan


def located(name: str | Path, folder: Path | None = None) -> Path:
    """Returns the path that a name in a file or an option means, to be read; it need not exist.

    Args:
        name: A path; `~` is the home folder.
        folder: What a relative path is relative to; default: the working folder.

    Raises:
        Unreadable: No path can have this name, its links lead round in a circle, or it is a pipe
            or a device.
    """
    try:
        path = (folder or Path()) / Path(name).expanduser()
        with suppress(FileNotFoundError, NotADirectoryError, PermissionError):
            mode = path.stat().st_mode
            path.resolve()
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                raise Unreadable(f"{shown(str(name))} {_NO_FILE}", "name a file")
        return path
    except RuntimeError:
        raise Unreadable(
            f"{shown(str(name))} names the home of an unknown user, or its links form a circle",
            "write the whole path",
        ) from None
    except (ValueError, OSError) as error:
        why = error.strerror if isinstance(error, OSError) else "a character no path can hold"
        raise Unreadable(f"{shown(str(name))} is not a path ({why})", "correct it") from None


def read_bytes(path: Path, most: int = MOST_TEXT_BYTES) -> bytes:
    """Reads a whole file, which must be a file: of a pipe or a device no end is known.

    Args:
        path: The file.
        most: Bytes from which it is refused.

    Raises:
        FileNotFoundError: It is missing.
        Unreadable: It is no regular file, is too large or cannot be read.
    """
    try:
        # Without the flag, opening a pipe waits for whoever writes to it.
        opened = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        with os.fdopen(opened, "rb") as stream:
            about = os.fstat(opened)
            if not stat.S_ISREG(about.st_mode):
                raise Unreadable(_NO_FILE, "name a file")
            content = stream.read(min(most, max(about.st_size, _PAGE)) + 1)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise Unreadable(f"cannot be read ({why})", "check the path and its rights") from error
    if len(content) > most:
        raise Unreadable(f"larger than {most / 1e6:g} MB", "split it, or name the right file")
    return content


def read_standard_input(most: int = MOST_TEXT_BYTES) -> str:
    """Reads all of standard input as UTF-8 text.

    Args:
        most: Bytes from which it is refused.

    Raises:
        Unreadable: It is larger, or no such text.
    """
    stream: Any = getattr(sys.stdin, "buffer", sys.stdin)
    content = stream.read(most + 1)
    if len(content) > most:
        raise Unreadable(f"larger than {most / 1e6:g} MB", "send less")
    try:
        return content if isinstance(content, str) else content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise Unreadable("is not UTF-8 text", "send plain UTF-8 text") from None


def read_text(path: Path, most: int = MOST_TEXT_BYTES) -> str:
    """Reads a whole file of UTF-8 text; a byte-order mark is left out.

    Args:
        path: The file.
        most: Bytes from which it is refused.

    Raises:
        FileNotFoundError: It is missing.
        Unreadable: It cannot be read, see :func:`read_bytes`, or is no such text.
    """
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Unreadable(
            f"is not UTF-8 text (byte {error.start})", "save it as plain UTF-8 text"
        ) from None


def parse_json(text: str) -> Any:
    """Reads JSON text.

    Args:
        text: The JSON.

    Raises:
        Unreadable: It is no JSON, nests too deep, repeats a key or holds a number of thousands of
            digits.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_repeats)
    except (ValueError, RecursionError) as error:
        reason = words_of(error)
        raise Unreadable(f"this is no JSON ({reason})", "correct it") from None


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of these keys and values; the JSON parser alone would keep the last of a key."""
    made = dict[str, Any]()
    for key, value in pairs:
        if key in made:
            raise ValueError(f"the key '{short(key)}' occurs twice")
        made[key] = value
    return made


def read_json(path: Path, most: int = MOST_TEXT_BYTES) -> Any:
    """Reads a JSON file.

    Args:
        path: The file.
        most: Bytes from which it is refused.

    Raises:
        FileNotFoundError: It is missing.
        Unreadable: It cannot be read or is no JSON, see :func:`parse_json`.
    """
    return parse_json(read_text(path, most))
