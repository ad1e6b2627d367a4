"""Which files are meant, and which reader each needs."""

import glob
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from fish_env.data.importing import limits
from fish_env.data.importing.bags import read_bag
from fish_env.data.importing.matlab import read_matlab
from fish_env.data.importing.source import Source
from fish_env.data.importing.tables import read_parquet, read_text_table, read_workbook
from fish_env.data.place import Place
from fish_env.reading import Unreadable, located, printable

Read = tuple[tuple[Source, ...], tuple[str, ...]]

READERS: dict[str, Callable[[Path], Read]] = {
    ".bag": read_bag,
    ".db3": read_bag,
    ".mcap": read_bag,
    ".mat": read_matlab,
    ".parquet": read_parquet,
    ".pq": read_parquet,
    ".xlsx": read_workbook,
    ".xlsm": read_workbook,
    ".csv": read_text_table,
    ".tsv": read_text_table,
    ".txt": read_text_table,
    ".dat": read_text_table,
    ".log": read_text_table,
}
_BAG = "metadata.yaml"


def open_logs(logs: Iterable[str | Path]) -> Read:
    """Reads every table of some logs.

    Args:
        logs: Files, folders of ROS 2 bags, folders of logs, and patterns with `*`.

    Returns:
        The tables, and notes of how files were read and what of them was left out.

    Raises:
        DatasetError: A file is missing or cannot be read.
    """
    sources, notes = list[Source](), list[str]()
    for file in _expand(logs):
        suffix = ".db3" if file.is_dir() else file.suffix.lower()
        if not file.is_dir():
            limits.check_is_file(file)
        with limits.bounded():
            found, told = READERS[suffix](file)
        sources += map(_presentable, found)
        notes += map(printable, told)
    return tuple(sources), tuple(notes)


def _presentable(source: Source) -> Source:
    """The same table, all names of which can be shown on one line.

    Raises:
        DatasetError: It has too many columns, too long names, or two that then are the same.
    """
    place = Place(source.file, column=one_line(source.part) or None)
    limits.check_columns(len(source.columns), place)
    long = next((name for name in source.columns if len(name) > limits.LONGEST_NAME), None)
    if long is not None:
        raise place.refuse(f"the name of a column has {len(long)} characters", "Shorten it")
    columns = {one_line(name): values for name, values in source.columns.items()}
    if len(columns) < len(source.columns):
        raise place.refuse("two columns have one name but for characters", "Rename one of them")
    return replace(
        source,
        part=one_line(source.part),
        columns=columns,
        units={one_line(name): one_line(unit) for name, unit in source.units.items()},
        kind=one_line(source.kind),
        frame_id=one_line(source.frame_id),
    )


def one_line(text: str) -> str:
    """A text with spaces in place of line ends, and escapes in place of control characters."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else printable(c) for c in text)


def _expand(logs: Iterable[str | Path]) -> list[Path]:
    files: list[Path] = []
    for log in logs:
        try:
            path = located(log)
        except Unreadable as error:
            raise Place(Path(printable(str(log)))).unreadable(error) from None
        if path.exists():
            files += _inside(path)
            continue
        matches = sorted(glob.glob(str(path), recursive=True))
        if not matches:
            raise Place(path).refuse("there is no such file", "Check the path or the pattern")
        files += [file for match in matches for file in _inside(Path(match))]
    twice = next((file for file, count in Counter(files).items() if count > 1), None)
    if twice is not None:
        raise Place(twice).refuse("the file is named twice", "Name it once")
    return files


def _inside(path: Path) -> list[Path]:
    """The path itself, or the logs in a folder that is no bag."""
    if path.is_dir() and not (path / _BAG).is_file():
        try:
            there = sorted(path.iterdir())
        except OSError as error:
            raise Place(path).refuse(
                f"the folder cannot be read ({error.strerror})", "Check its rights"
            ) from None
        inside = [
            file for file in there if file.suffix.lower() in READERS or (file / _BAG).is_file()
        ]
        if not inside:
            raise Place(path).refuse("the folder holds no log", f"Endings read: {_endings()}")
        return inside
    if not path.is_dir() and path.suffix.lower() not in READERS:
        raise Place(path).refuse(
            f"logs with the ending '{path.suffix}' are not read",
            f"Save it in one of these: {_endings()}",
        )
    return [path]


def _endings() -> str:
    return ", ".join(READERS)
