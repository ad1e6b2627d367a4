"""Which files are meant, and which reader each needs."""

import glob
from collections.abc import Callable, Iterable
from pathlib import Path

from fish_env.data.importing.bags import read_bag
from fish_env.data.importing.matlab import read_matlab
from fish_env.data.importing.source import Source
from fish_env.data.importing.tables import read_parquet, read_text_table, read_workbook
from fish_env.data.place import Place

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
        found, told = READERS[suffix](file)
        sources += found
        notes += told
    return tuple(sources), tuple(notes)


def _expand(logs: Iterable[str | Path]) -> list[Path]:
    files: list[Path] = []
    for log in logs:
        path = Path(log).expanduser()
        if path.exists():
            files += _inside(path)
            continue
        matches = sorted(glob.glob(str(path), recursive=True))
        if not matches:
            raise Place(path).refuse("there is no such file", "Check the path or the pattern")
        files += [file for match in matches for file in _inside(Path(match))]
    twice = next((file for file in files if files.count(file) > 1), None)
    if twice is not None:
        raise Place(twice).refuse("the file is named twice", "Name it once")
    return files


def _inside(path: Path) -> list[Path]:
    """The path itself, or the logs in a folder that is no bag."""
    if path.is_dir() and not (path / _BAG).is_file():
        inside = [
            file
            for file in sorted(path.iterdir())
            if file.suffix.lower() in READERS or (file / _BAG).is_file()
        ]
        if not inside:
            raise Place(path).refuse("the folder holds no log", f"Endings read: {_endings()}")
        return inside
    if path.is_file() and path.suffix.lower() not in READERS:
        raise Place(path).refuse(
            f"logs with the ending '{path.suffix}' are not read",
            f"Save it in one of these: {_endings()}",
        )
    return [path]


def _endings() -> str:
    return ", ".join(READERS)
