"""Whether a MATLAB file of version 5 to 7 can be read in bounded time and memory.

SciPy takes memory for as many cells as a header promises, and follows cells within cells on the
stack of the processor. So the headers are gone through first.

Format: MathWorks, *MAT-File Format*, version 5 (Level 5 MAT-files).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator

from fish_env.data.importing import limits

MOST_UNPACKED = 500_000_000
"""Bytes of a file, its variables unpacked."""
MOST_ELEMENTS = 1_000_000
"""Elements of a file, headers and those within cells and structs among them."""
HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT = 1, 2, 3
_SMALLEST = 8
"""Bytes of the smallest element."""

Element = tuple[int, memoryview]
"""Type and content."""


def check(content: bytes) -> None:
    """Goes through the headers of all variables, those within cells and structs too.

    Args:
        content: Of a file of version 5 to 7.

    Raises:
        ValueError, struct.error, zlib.error: It unpacks to too much, nests too deep, or promises
            more elements than it holds.
    """
    headers = _Headers("<" if content[126:128] == b"IM" else ">")
    left = MOST_UNPACKED
    for kind, body in headers.elements(memoryview(content)[HEADER:]):
        if kind == _COMPRESSED:
            unpacked = _unpacked(body, left)
            left -= len(unpacked)
            # One variable; what may follow it is not read.
            headers.check(*next(headers.elements(memoryview(unpacked)), (0, memoryview(b""))))
        else:
            left -= len(body)
            headers.check(kind, body)
        if left < 0:
            raise _too_large()


def _too_large() -> ValueError:
    return ValueError(f"it unpacks to more than {MOST_UNPACKED / 1e6:.0f} MB; save fewer variables")


def _unpacked(body: memoryview, most: int) -> bytes:
    stream = zlib.decompressobj()
    unpacked = stream.decompress(body, most + 1)
    if len(unpacked) > most:
        raise _too_large()
    return unpacked


class _Headers:
    """The headers of one file, in its order of bytes."""

    def __init__(self, order: str) -> None:
        self._order = order
        self._met = 0

    def elements(self, content: memoryview) -> Iterator[Element]:
        """Elements that follow each other; each begins at a multiple of eight bytes."""
        at = 0
        while at + _SMALLEST <= len(content):
            self._met += 1
            if self._met > MOST_ELEMENTS:
                raise ValueError(f"more than {MOST_ELEMENTS:,} cells and fields; save vectors")
            word, size = struct.unpack_from(f"{self._order}II", content, at)
            small = word >> 16
            if small:  # the content stands in the second half of the tag
                yield word & 0xFFFF, content[at + 4 : at + 4 + min(small, 4)]
                at += _SMALLEST
                continue
            yield word, content[at + _SMALLEST : at + _SMALLEST + size]
            # What is compressed is not padded.
            at += _SMALLEST + (size if word == _COMPRESSED else -(-size // 8) * 8)

    def check(self, kind: int, body: memoryview, depth: int = 0) -> None:
        """Checks one variable, and what a cell or struct holds."""
        if kind != _MATRIX or not len(body):
            return
        if depth > limits.DEEPEST:
            raise ValueError(f"cells or structs nested more than {limits.DEEPEST} levels deep")
        parts = self.elements(body)
        flags, shape = next(parts, None), next(parts, None)
        if flags is None or shape is None:
            raise ValueError("a variable without a size")
        count = math.prod(struct.unpack(f"{self._order}{len(shape[1]) // 4}i", shape[1]))
        own = struct.unpack_from(f"{self._order}I", flags[1])[0] & 0xFF
        holds_others = own in (_CELL, _STRUCT, _OBJECT)
        # A cell takes at least eight bytes; a sparse matrix holds fewer numbers than elements.
        most = len(body) // _SMALLEST if holds_others else limits.MOST_VALUES
        if not 0 <= count <= most:
            raise ValueError(f"a variable of {count} elements in {len(body)} bytes")
        if holds_others:
            for inner_kind, inner in parts:
                self.check(inner_kind, inner, depth + 1)
