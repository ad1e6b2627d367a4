"""Tables of motion as files: CSV with a description beside it, or Parquet.

A CSV file has no place for the version or for units that every program passes over. They stand in
``NAME.csv-metadata.json``, where "Metadata Vocabulary for Tabular Data" (W3C, 2015) has readers
look for them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.errors import missing_extra
from fish_env.files import check_chosen, replacing, write_text
from fish_env.version import WRITER


def write_csv(columns: Mapping[str, FloatArray], stream: TextIO) -> None:
    """Writes columns as CSV with 17 significant digits, which read back equal.

    Args:
        columns: Name -> values, each (T,).
        stream: What is written to.
    """
    table = np.column_stack(list(columns.values()))
    np.savetxt(stream, table, delimiter=",", fmt="%.17g", header=",".join(columns), comments="")


def write_csv_file(columns: Mapping[str, FloatArray], path: str | Path) -> None:
    """Writes a CSV file as :func:`write_csv` does, and its description beside it.

    Args:
        columns: Name -> values, each (T,).
        path: The CSV file.

    Raises:
        OutputError: A file cannot be written, or the description would replace another file.
    """
    check_description(path)
    with replacing(path) as part, part.open("w", encoding="utf-8") as stream:
        write_csv(columns, stream)
    if Path(path).is_file():  # and no pipe or device
        content = _description(columns, Path(path).name)
        write_text(description_file(path), json.dumps(content, indent=1) + "\n")


def write_parquet_file(columns: Mapping[str, FloatArray], path: str | Path) -> None:
    """Writes columns as Parquet, with the version in the file.

    Args:
        columns: Name -> values, each (T,).
        path: The Parquet file.

    Raises:
        MissingExtraError: pyarrow is not installed.
        OutputError: The file cannot be written.
    """
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise missing_extra("Writing Parquet", "pyarrow", "parquet") from None
    import pandas as pd

    with replacing(path) as part:
        frame = pd.DataFrame(columns)
        frame.attrs["written_by"] = WRITER
        frame.to_parquet(part, index=False)


def description_file(path: str | Path) -> Path:
    """The file that describes a CSV file.

    Args:
        path: The CSV file.
    """
    return Path(f"{path}-metadata.json")


def check_description(path: str | Path) -> None:
    """Refuses a CSV file whose description would replace what this program did not write.

    Args:
        path: The CSV file.

    Raises:
        OutputError: Names the file in the description's place.
    """
    check_chosen([description_file(path)])


def _description(columns: Iterable[str], file: str) -> dict[str, Any]:
    from fish_env.data.units import SI_UNIT  # slow to import, and every simulator imports this
    from fish_env.data.vocabulary import COMMANDS, FILE_CHANNELS

    units = {name: SI_UNIT[known.dimension] for name, known in (FILE_CHANNELS | COMMANDS).items()}
    units |= {"t": "s", "tail_phase": "rad"}
    described: list[dict[str, str]] = [
        {"name": name, "titles": name, "datatype": "double"}
        | ({"schema:unitText": units[name]} if name in units else {})
        for name in columns
    ]
    return {
        "@context": "http://www.w3.org/ns/csvw",
        "url": file,
        "dc:creator": WRITER,
        "tableSchema": {"columns": described},
    }
