"""Whether a MATLAB file of version 5 to 7 can be read in bounded time and memory.

SciPy takes memory for as many cells as a header promises, and follows cells within cells on the
stack of the processor. It looks up types of data without checking them, so that a flipped bit ends
the process. So all headers are gone through first.

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
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE = 1, 2, 3, 4, 5
_LAST_NUMERIC, _FUNCTION, _OPAQUE = 15, 16, 17
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13))
_TEXTS = frozenset((16, 17, 18))
_COMPLEX = 0x800
_HEADERS = [6, 5, 1]
"""Types of the elements that begin each variable: flags, shape and name."""
_MOST_DIMENSIONS = 32
_KNOWN = _NUMBERS | _TEXTS | {_MATRIX, _COMPRESSED}
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
            kind = word & 0xFFFF if small else word
            # What is compressed is not padded.
            padded = size if kind == _COMPRESSED else -(-size // 8) * 8
            if small > 4 or (not small and at + _SMALLEST + size > len(content)):
                raise ValueError("an element that is longer than what holds it")
            if kind not in _KNOWN or (kind == _MATRIX and size != padded):
                raise ValueError(f"an element of type {kind} and {size} bytes")
            if small:  # the content stands in the second half of the tag
                yield kind, content[at + 4 : at + 4 + small]
                at += _SMALLEST
            else:
                yield kind, content[at + _SMALLEST : at + _SMALLEST + size]
                at += _SMALLEST + padded

    def check(self, kind: int, body: memoryview, depth: int = 0) -> None:
        """Checks one variable, and what a cell or struct holds."""
        if kind != _MATRIX or not len(body):
            return
        if depth > limits.DEEPEST:
            raise ValueError(f"cells or structs nested more than {limits.DEEPEST} levels deep")
        parts = list(self.elements(body))
        if [kind for kind, _ in parts[:3]] != _HEADERS or len(parts[0][1]) != 8:
            raise ValueError("a variable without a size or a name")
        flags = struct.unpack_from(f"{self._order}I", parts[0][1])[0]
        shape = struct.unpack(f"{self._order}{len(parts[1][1]) // 4}i", parts[1][1])
        if not 2 <= len(shape) <= _MOST_DIMENSIONS:
            raise ValueError(f"a variable of {len(shape)} dimensions")
        count, own = math.prod(shape), flags & 0xFF
        holds_others = own in (_CELL, _STRUCT, _OBJECT)
        # A cell takes at least eight bytes; a sparse matrix holds fewer numbers than elements.
        most = len(body) // _SMALLEST if holds_others else limits.MOST_VALUES
        if min(shape, default=0) < 0 or count > most:
            raise ValueError(f"a variable of {count} elements in {len(body)} bytes")
        if _CHAR <= own <= _LAST_NUMERIC:
            _check_numbers(own, flags, [kind for kind, _ in parts[3:]])
        elif holds_others:
            self._check_held(own, count, parts[2:], depth)
        elif own not in (_FUNCTION, _OPAQUE):
            raise ValueError(f"a variable of class {own}")
        for inner_kind, inner in parts:
            self.check(inner_kind, inner, depth + 1)

    def _check_held(self, own: int, count: int, parts: list[Element], depth: int) -> None:
        """Refuses a cell or struct that promises more than it holds."""
        before = {_CELL: 1, _STRUCT: 3, _OBJECT: 4}[own]
        held = parts[before:]
        fields = 1
        if own != _CELL:
            if len(parts) < before or len(parts[before - 2][1]) != 4:
                raise ValueError("a struct without fields")
            length = struct.unpack(f"{self._order}i", parts[before - 2][1])[0]
            if length < 1 or len(parts[before - 1][1]) % length:
                raise ValueError("a struct whose fields have no names")
            fields = len(parts[before - 1][1]) // length
        if len(held) != count * fields or any(kind != _MATRIX for kind, _ in held):
            raise ValueError(f"{len(held)} variables where {count * fields} are promised")


def _check_numbers(own: int, flags: int, kinds: list[int]) -> None:
    """Refuses numbers or text whose parts are missing or of a type that has none."""
    parts = (3 if own == _SPARSE else 1) + bool(flags & _COMPLEX)
    allowed = _NUMBERS | _TEXTS if own == _CHAR else _NUMBERS
    if len(kinds) != parts or not allowed.issuperset(kinds):
        raise ValueError(f"a variable of class {own} with data of the types {kinds}")
