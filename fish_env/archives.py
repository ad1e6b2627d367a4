"""NumPy's archives (`.npz`) read without pickles and in bounded memory, and their checksums."""

from __future__ import annotations

import hashlib
import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = Mapping[str, npt.NDArray[Any]]
UNREADABLE = (
    zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, KeyError, RuntimeError,
    TypeError, OverflowError, MemoryError, struct.error, tokenize.TokenError, SyntaxError,
)  # fmt: skip
"""What a damaged archive raises; RuntimeError where it seems encrypted or of a later ZIP."""


def read_arrays(content: bytes, most: int) -> dict[str, npt.NDArray[Any]]:
    """Unpacks NumPy's archive without pickles, in bounded memory.

    Args:
        content: of the file.
        most: bytes that may be unpacked; a header that asks for more is refused, whatever the
            archive says of its sizes.

    Raises:
        ValueError, KeyError, BadZipFile: no such archive, damaged, larger, or with two arrays of
            one name.
    """
    arrays = dict[str, npt.NDArray[Any]]()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        left = most
        for member in archive.infolist():
            with archive.open(member) as stream:
                packed = stream.read(left + 1)
            left -= len(packed)
            if left < 0:
                raise ValueError(f"more than {most / 1e6:g} MB unpacked")
            if not member.filename.endswith(".npy"):
                raise ValueError(f"{member.filename!r} is no array")
            name = member.filename.removesuffix(".npy")
            if name in arrays:  # another reader might take the other one
                raise ValueError(f"two arrays {name!r}")
            _check_size(packed, most)
            array = np.lib.format.read_array(io.BytesIO(packed), allow_pickle=False)
            arrays[name] = array
    return arrays


def _check_size(packed: bytes, most: int) -> None:
    """Refuses a header that promises more than the file holds, before memory is taken for it."""
    stream = io.BytesIO(packed)
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0
    if version != (1, 0):
        read = np.lib.format.read_array_header_2_0
    shape, _, kind = read(stream)
    if math.prod(shape) * kind.itemsize > most or any(size < 0 for size in shape):
        raise ValueError(f"an array of shape {shape}")


def digest(document: str, arrays: Arrays) -> str:
    """Checksum (SHA-256) of a text and of arrays with their names, types and shapes.

    Args:
        document: the text, such as a description in JSON.
        arrays: by name; their order does not matter.
    """
    sums = hashlib.sha256(document.encode())
    for name in sorted(arrays):
        value = np.ascontiguousarray(arrays[name])
        sums.update(f"{name} {value.dtype.str} {value.shape}".encode())
        sums.update(value.tobytes())
    return sums.hexdigest()
