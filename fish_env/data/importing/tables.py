"""Text tables of any shape, Excel workbooks and Parquet files, read as data only."""

import csv
import io
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data.importing import limits
from fish_env.data.importing.grid import columns_of
from fish_env.data.importing.source import Source, Values, reading
from fish_env.data.place import Place
from fish_env.errors import missing_extra

Read = tuple[tuple[Source, ...], tuple[str, ...]]

SEPARATORS = (";", "\t", ",", "|", None)
"""None is any number of spaces. A comma comes after those that leave it to the decimals."""
COMMENTS = ("#", "%", "//")
MOST_UNPACKED = 500_000_000
"""Bytes of a workbook; a full sheet of numbers with twenty columns has this."""
MOST_ROWS = 2**20
"""Of a sheet, as Excel has it."""
_SAMPLE = 200
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
_POINT_NUMBER = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")


def read_text_table(file: Path) -> Read:
    """Reads a text table, whatever separates its cells and its decimals.

    Args:
        file: The file.

    Returns:
        One table, and a note of what was found out about the file.

    Raises:
        DatasetError: It holds no table.
    """
    with reading(file, "a text table"):
        text, encoding = _decode(file)
        lines = _without_comments(text.splitlines())
        separator = find_separator(lines)
        rows = _split(lines, separator)
        comma = _has_decimal_comma(rows)
        # Empty lines keep their place, so that rows can be named by their line.
        columns, units, first = columns_of(rows, Place(file), comma)
    shown = {"\t": "tab", None: "spaces"}.get(separator, f"'{separator}'")
    how = f"read with separator {shown}, decimal {'comma' if comma else 'point'}, {encoding}"
    return (Source(file, "", columns, units, first_row=first + 1),), (f"{file.name}: {how}",)


def _decode(file: Path) -> tuple[str, str]:
    raw = limits.content(file)
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16"), "UTF-16"
    try:
        return raw.decode("utf-8-sig"), "UTF-8"
    except UnicodeDecodeError:
        if b"\0" in raw:
            raise Place(file).refuse("this is no text", "Check its ending") from None
        return raw.decode("cp1252", "replace"), "Windows-1252"


def _without_comments(lines: list[str]) -> list[str]:
    """Lines without comments; above the first line that is none, a header may be behind the sign.

    A comment leaves an empty line, so that rows can be named by their line.
    """
    kept, above = list[str](), True
    for line in lines:
        sign = next((sign for sign in COMMENTS if line.lstrip().startswith(sign)), None)
        above = above and (sign is not None or not line.strip())
        bare = line.strip()[len(sign or "") :].strip() if above else ""
        kept.append(line if sign is None else bare)
    return kept


def find_separator(lines: list[str]) -> str | None:
    """The separator that cuts most lines into one number of cells, more than one.

    Args:
        lines: Lines of the file.

    Returns:
        One of `SEPARATORS`.
    """
    sample = [line for line in lines if line.strip()][-_SAMPLE:]
    best = 0.0
    found: str | None = ","
    for separator in SEPARATORS:
        counts = [len(_cut(line, separator)) for line in sample]
        usual = max(set(counts), key=counts.count, default=1)
        share = counts.count(usual) / max(1, len(counts))
        if usual > 1 and share > best + 0.05:
            best, found = share, separator
    return found


def _cut(line: str, separator: str | None) -> list[str]:
    return line.split(separator)


def _split(lines: list[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    reader = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator, skipinitialspace=True)
    return [[cell.strip() for cell in row] for row in reader]


def _has_decimal_comma(rows: list[list[str]]) -> bool:
    cells = [cell for row in rows[-_SAMPLE:] for cell in row]
    commas = sum(bool(_COMMA_NUMBER.fullmatch(cell)) for cell in cells)
    return commas > sum(bool(_POINT_NUMBER.fullmatch(cell)) for cell in cells)


def read_workbook(file: Path) -> Read:
    """Reads the sheets of an Excel workbook: a table each. Formulas give their saved values.

    Args:
        file: An `.xlsx` or `.xlsm` file; macros are neither read nor run.

    Returns:
        The sheets, and a note for each that holds no table.

    Raises:
        MissingExtraError: openpyxl is not installed.
        DatasetError: It is no workbook.
    """
    try:
        import openpyxl
    except ImportError:
        raise missing_extra("Reading Excel files", "openpyxl", "logs") from None
    sources, notes = [], []
    with reading(file, "an Excel workbook"):
        _check_unpacked(file)
        book = openpyxl.load_workbook(
            file, read_only=True, data_only=True, keep_vba=False, keep_links=False
        )
        try:
            for sheet in book.worksheets:
                place = Place(file, column=sheet.title)
                rows = _rows(sheet, place)
                if sum(any(cell is not None for cell in row) for row in rows) < 3:
                    notes.append(f"{file.name}: sheet {sheet.title} left out: it holds no table")
                    continue
                columns, units, first = columns_of(rows, place)
                units |= {name: "ns" for name in columns if _are_dates(rows[first:], columns, name)}
                sources.append(Source(file, sheet.title, columns, units, first_row=first + 1))
        finally:
            book.close()
    if not sources:
        raise Place(file).refuse("no sheet holds a table", "Give a header and rows below it")
    return tuple(sources), tuple(notes)


def _check_unpacked(file: Path) -> None:
    """Refuses an archive that unpacks to far more than a sheet can hold."""
    with zipfile.ZipFile(file) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > MOST_UNPACKED:
        raise Place(file).refuse(
            f"it unpacks to {size / 1e6:.0f} MB, more than {MOST_UNPACKED / 1e6:.0f} MB",
            "Save the sheets as CSV or Parquet, or split them",
        )


def _rows(sheet: Any, place: Place) -> list[list[Any]]:
    """Cells of a sheet as they stand in it; what the file says of its size is not believed."""
    sheet.reset_dimensions()
    rows, cells = [], 0
    for row in sheet.iter_rows(values_only=True):
        rows.append(list(row))
        cells += len(row) + 1
        if cells > limits.MOST_CELLS or len(rows) > MOST_ROWS:
            raise place.refuse(
                f"more than {limits.MOST_CELLS:,} cells or {MOST_ROWS:,} rows, with the empty ones",
                "Delete empty rows and columns, or split the sheet",
            )
    return rows


def _are_dates(body: list[list[Any]], columns: dict[str, Values], name: str) -> bool:
    index = list(columns).index(name)
    return columns[name].dtype == np.int64 and hasattr(body[0][index], "year")


def read_parquet(file: Path) -> Read:
    """Reads the columns of a Parquet file as plain numbers, times and text.

    Args:
        file: The file.

    Returns:
        One table, and a note for each column that was left out.

    Raises:
        MissingExtraError: pyarrow is not installed.
        DatasetError: It is no such file.
    """
    try:
        import pyarrow.parquet
    except ImportError:
        raise missing_extra("Reading Parquet", "pyarrow", "logs") from None
    columns, units, notes = dict[str, Values](), dict[str, str](), []
    with reading(file, "a Parquet file"):
        opened = pyarrow.parquet.ParquetFile(file)
        _check_size(file, opened.metadata)
        table = opened.read(use_threads=False)
        for name, column in zip(table.column_names, table.columns, strict=True):
            values, unit = _arrow_values(column)
            if values is None:
                notes.append(f"{file.name}: {name} left out: it holds {column.type}")
                continue
            columns[name] = values
            units |= {name: unit} if unit else {}
    if not columns:
        raise Place(file).refuse("no column holds numbers", "Save numbers")
    return (Source(file, "", columns, units),), tuple(notes)


def _check_size(file: Path, about: Any) -> None:
    if about.num_rows * about.num_columns > limits.MOST_VALUES:
        raise Place(file).refuse(
            f"{about.num_rows:,} rows of {about.num_columns} columns, more than "
            f"{limits.MOST_VALUES:,} values",
            "Split it, or leave columns out",
        )


def _arrow_values(column: Any) -> tuple[Values | None, str]:
    """A column as an array, and its unit where its type has one."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        return _arrow_values(column.cast(kind.value_type))
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        return column.cast(pa.int64()).to_numpy(), kind.unit
    if pa.types.is_integer(kind) and not column.null_count:
        return column.to_numpy().astype(np.int64), ""
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind):
        return column.cast(pa.float64()).to_numpy().astype(np.float64), ""
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return np.array([text or "" for text in column.to_pylist()], dtype=object), ""
    return None, ""
