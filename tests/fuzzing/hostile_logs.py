"""Small logs that take hours, gigabytes or the whole stack to read, for `robofish import`.

The tests lower the limits of size, so that these are made quickly.
"""

from __future__ import annotations

import io
import os
import sqlite3
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

Maker = Callable[[Path], object]


def element(kind: int, content: bytes) -> bytes:
    """One element of a MATLAB file of version 5."""
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def variable(kind: int, shape: tuple[int, ...], content: bytes) -> bytes:
    flags, sizes = struct.pack("<II", kind, 0), struct.pack(f"<{len(shape)}i", *shape)
    return element(14, element(6, flags) + element(5, sizes) + element(1, b"a") + content)


def matlab(content: bytes, order: bytes = b"IM") -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01" + order + content


def nested_cells(depth: int) -> bytes:
    """Cells in cells; the sizes are written from the inside, without copying for each level."""
    inner = variable(6, (2, 1), element(9, b"\0" * 16))
    head = element(6, struct.pack("<II", 1, 0)) + element(5, struct.pack("<2i", 1, 1))
    head += element(1, b"a")
    levels, size = list[bytes](), len(inner)
    for _ in range(depth):
        size += len(head)
        levels.append(struct.pack("<II", 14, size) + head)
        size += 8
    return b"".join(levels[::-1]) + inner


def unpacking(megabytes: int) -> bytes:
    """A variable of zeros that is packed a thousand to one."""
    size = megabytes << 20
    head = variable(6, (size // 8, 1), b"")[8:]
    start = struct.pack("<II", 14, len(head) + 8 + size) + head + struct.pack("<II", 9, size)
    packing = zlib.compressobj(9)
    packed = packing.compress(start)
    packed += b"".join(packing.compress(bytes(1 << 20)) for _ in range(megabytes))
    packed += packing.flush()
    return struct.pack("<II", 15, len(packed)) + packed


def hdf5(fill: Callable[..., None]) -> Maker:
    def make(file: Path) -> None:
        import h5py

        with h5py.File(file, "w") as opened:
            fill(opened)

    return make


def many_links(opened) -> None:
    opened.create_group("g0")["v"] = np.arange(3.0)
    for i in range(1, 40):
        group = opened.create_group(f"g{i}")
        group["a"] = group["b"] = opened[f"g{i - 1}"]


def circle(opened) -> None:
    group = opened.create_group("g")
    group["itself"] = group


def many_references(opened) -> None:
    import h5py

    last = opened.create_dataset("v", data=np.arange(3.0))
    for i in range(40):
        references = opened.create_dataset(f"r{i}", (3,), dtype=h5py.ref_dtype)
        references[:] = [last.ref] * 3
        last = references


def never_written(opened) -> None:
    for i in range(40):
        opened.create_dataset(f"v{i}", (9_900_000,), dtype="f8", chunks=(1 << 20,))


ROWS = "".join(
    f'<row r="{i}"><c r="A{i}"><v>{i}</v></c><c r="B{i}"><v>0</v></c></row>' for i in (1, 2, 3)
)


def workbook(rows: str, size: str = "A1:B3", before: str = "") -> Maker:
    """A workbook with these rows below two rows of numbers."""
    names = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    sheet = f'<dimension ref="{size}"/><sheetData>{ROWS}{rows}</sheetData>'
    content = f'{before}<worksheet xmlns="{names}">{sheet}</worksheet>'

    def make(file: Path) -> None:
        import openpyxl

        plain = io.BytesIO()
        openpyxl.Workbook().save(plain)
        with (
            zipfile.ZipFile(plain) as source,
            zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as target,
        ):
            for name in source.namelist():
                own = name == "xl/worksheets/sheet1.xml"
                target.writestr(name, content if own else source.read(name))

    return make


ENTITIES = (
    '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "aaaaaaaaaa">'
    + "".join(
        f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
    )
    + "]>"
)
OUTSIDE = '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY j SYSTEM "file:///etc/hostname">]>'
ENTITY = '<row r="4"><c r="A4" t="inlineStr"><is><t>&j;</t></is></c></row>'


def parquet(table: Callable[[], object], times: int = 1) -> Maker:
    def make(file: Path) -> None:
        import pyarrow.parquet

        content = table()
        with pyarrow.parquet.ParquetWriter(file, content.schema, compression="zstd") as writer:
            for _ in range(times):
                writer.write_table(content)

    return make


def zeros():
    import pyarrow

    return pyarrow.table({"t": np.zeros(1_000_000)})


def long_words():
    import pyarrow

    words = pyarrow.array(["x" * 100_000])
    column = pyarrow.DictionaryArray.from_arrays(np.zeros(100_000, np.int32), words)
    return pyarrow.table({"t": np.arange(100_000) * 0.01, "word": column})


def database(statements: str) -> Maker:
    def make(file: Path) -> None:
        with sqlite3.connect(file) as opened:
            opened.executescript(statements)
        opened.close()

    return make


TOPICS = (
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT,"
    " offered_qos_profiles TEXT); INSERT INTO topics VALUES"
    "(1, '/a', 'std_msgs/msg/Float64', 'cdr', '');"
)
ENDLESS = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
COMPUTED_DATA = (
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
    " data BLOB AS (zeroblob(900000000)));"
    "INSERT INTO messages(id, topic_id, timestamp) VALUES (1, 1, 1), (2, 1, 2), (3, 1, 3);"
)
MESSAGES = "CREATE TABLE messages(id, topic_id, timestamp, data);"


def bag(definition: str, message: bytes = b"\0\1\0\0" + bytes(8)) -> Maker:
    """A bag with one topic of this definition."""

    def make(folder: Path) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer

        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            topic = writer.add_connection("/x", "a/msg/B", msgdef=definition, rihs01="RIHS01_0")
            for i in range(3):
                writer.write(topic, i, message)

    return make


def metadata(text: str) -> Maker:
    def make(folder: Path) -> None:
        folder.mkdir()
        (folder / "metadata.yaml").write_text(text)

    return make


def packed_bag(folder: Path) -> None:
    """A file that unpacks to a thousand times its size, on the disk."""
    from backports import zstd

    packing = zstd.ZstdCompressor()
    packed = b"".join(packing.compress(bytes(1 << 24)) for _ in range(4)) + packing.flush()
    metadata(
        "rosbag2_bagfile_information: {version: 5, compression_format: zstd, compression_mode: "
        "FILE, storage_identifier: sqlite3, relative_file_paths: [x.db3.zstd], "
        "topics_with_message_count: [], duration: {nanoseconds: 0}, starting_time: "
        "{nanoseconds_since_epoch: 0}, message_count: 0}"
    )(folder)
    (folder / "x.db3.zstd").write_bytes(packed)


def text(content: str) -> Maker:
    return lambda file: file.write_text(content)


def raw(content: Callable[[], bytes]) -> Maker:
    return lambda file: file.write_bytes(content())


def numbered(count: int) -> str:
    return ",".join(f"c{i}" for i in range(count)) + "\n" + (",".join("0" * count) + "\n") * 3


def matlab_5(file: Path) -> None:
    from scipy.io import savemat

    struct_ = {"t": np.arange(9.0), "x": np.arange(9.0)}
    savemat(file, {"pose": struct_, "cells": np.array([1, "a"], object)}, do_compression=False)


def plain_group(opened) -> None:
    opened["t"], opened["x"] = np.arange(9.0), np.arange(9.0)


def plain_table():
    import pyarrow

    return pyarrow.table({"t": np.arange(9.0), "word": ["a"] * 9})


MESSAGE = "INSERT INTO messages VALUES (1, 1, 5, x'000100000000000000000000'), (2, 1, 6, x'00');"
ORDINARY: dict[str, Maker] = {
    "x.csv": text("t;x [mm]\n" + "".join(f"{i};{i},5\n" for i in range(9))),
    "x5.mat": matlab_5,
    "x7.mat": hdf5(plain_group),
    "x.xlsx": workbook(""),
    "x.parquet": parquet(plain_table),
    "x": bag("float64 x\nfloat64[] y\nstring z\n", b"\0\1\0\0" + bytes(24)),
    "x.db3": database(TOPICS + MESSAGES + MESSAGE),
}
"""Logs that are as they should be, to be damaged."""

LOGS: dict[str, tuple[str, Maker, str]] = {
    "a pipe": ("x.csv", os.mkfifo, "not a file"),
    "a pipe as a bag": ("x.bag", os.mkfifo, "not a file"),
    "a pipe as MATLAB": ("x.mat", os.mkfifo, "not a file"),
    "a device": ("x.csv", lambda file: file.symlink_to("/dev/zero"), "not a file"),
    "a circle of links": ("x.csv", lambda file: file.symlink_to(file), "x.csv"),
    "a wide table": ("x.csv", text(numbered(200_000)), "columns"),
    "a long name": ("x.csv", text("t," + "x " * 50_000 + "\n0,1\n1,2\n2,3\n"), "characters"),
    "cells of gigabytes": ("x.mat", raw(lambda: matlab(variable(1, (2**31 - 1, 1), b""))), "elem"),
    "the same, the other order": (
        "x.mat", raw(lambda: matlab(variable(1, (2**31 - 1, 1), b""), b"XX")), "x.mat",
    ),
    "cells in cells": ("x.mat", raw(lambda: matlab(nested_cells(200_000))), "nested"),
    "data of an unknown type": (
        "x.mat", raw(lambda: matlab(variable(6, (2, 1), element(35337, bytes(16))))), "type",
    ),
    "text without a size": (
        "x.mat", raw(lambda: matlab(variable(4, (), element(16, b"text")))), "dimensions",
    ),
    "a struct without its fields": (
        "x.mat",
        raw(lambda: matlab(variable(2, (1, 1), element(5, b"\4\0\0\0") + element(1, b"abc\0")))),
        "promised",
    ),
    "a packed variable": ("x.mat", raw(lambda: matlab(unpacking(60))), "unpacks to"),
    "HDF5 with many links": ("x.mat", hdf5(many_links), "links"),
    "HDF5 in a circle": ("x.mat", hdf5(circle), "nested"),
    "HDF5 with many references": ("x.mat", hdf5(many_references), "links"),
    "HDF5 never written": ("x.mat", hdf5(never_written), "values"),
    "a gap of a billion rows": (
        "x.xlsx", workbook('<row r="999999999"><c r="A999999999"><v>5</v></c></row>'), "rows",
    ),
    "rows with a last cell": (
        "x.xlsx",
        workbook("".join(f'<row r="{i}"><c r="XFD{i}"><v>5</v></c></row>' for i in range(4, 3000))),
        "cells",
    ),
    "a packed sheet": (
        "x.xlsx", workbook(f'<row r="4"><c r="A4"><v>{" " * 60_000_000}</v></c></row>'),
        "unpacks to",
    ),
    "entities of entities": ("x.xlsx", workbook(ENTITY, before=ENTITIES), "Excel workbook"),
    "an entity outside": ("x.xlsx", workbook(ENTITY, before=OUTSIDE), "Excel workbook"),
    "repeated zeros": ("x.parquet", parquet(zeros, 12), "values"),
    "repeated words": ("x.parquet", parquet(long_words), "memory"),
    "computed data": ("x.db3", database(TOPICS + COMPUTED_DATA), "computed"),
    "an endless view": (
        "x.db3",
        database(
            f"{TOPICS}{MESSAGES} CREATE VIEW schema AS {ENDLESS} SELECT count(*) AS "
            "schema_version FROM c;"
        ),
        "computed",
    ),
    "a name with a question": ("x?mode=rwc&.db3", database(TOPICS + MESSAGES), "Rename"),
    "long arrays": ("x", bag("".join(f"string[10000] a{i}\n" for i in range(300))), "elements"),
    "many fields": ("x", bag("".join(f"float64 a{i}\n" for i in range(5000))), "fields"),
    "a type in itself": ("x", bag("B a\nfloat64 x\n"), "x"),
    "metadata of aliases": (
        "x",
        metadata(
            "a0: &a0 [1, 2]\n"
            + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12))
        ),
        "values",
    ),
    "large metadata": ("x", metadata("x: [" + "1," * 600_000 + "1]"), "larger than"),
    "a packed bag": ("x", packed_bag, "temporary folder"),
}  # fmt: skip
"""Name -> name of the log, what makes it, and a word of the refusal."""
