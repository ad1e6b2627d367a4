"""Trees of plain values as one file: arrays in NumPy's archive, the rest as JSON. No pickles.

Reading such a file can run no code: arrays of objects are refused, and JSON holds data alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.archives import digest, read_arrays
from fish_env.files import replacing
from fish_env.reading import Unreadable, parse_json, read_bytes

Tree = Any
"""None, bool, int, float, str, array, list of trees, or mapping from str to trees."""
MOST_BYTES = 8_000_000_000
"""A replay buffer of a million steps has one."""
TREE, DIGEST, ARRAY = "tree", "digest", "__array__"


def write_plain(tree: Tree, path: Path) -> None:
    """Writes a tree atomically.

    Args:
        tree: plain values; tuples become lists, NumPy's numbers arrays.
        path: the file.

    Raises:
        TypeError: something that is not plain; names where it stands.
        OutputError: the file cannot be written.
    """
    arrays: dict[str, npt.NDArray[Any]] = {}
    document = json.dumps(_without_arrays(tree, arrays, "tree"))
    with replacing(path) as part, part.open("wb") as stream:
        words = {TREE: np.array(document), DIGEST: np.array(digest(document, arrays))}
        np.savez(stream, **words, **arrays)  # type: ignore[arg-type]


def read_plain(path: Path) -> Tree:
    """Reads what :func:`write_plain` wrote.

    Raises:
        OSError, ValueError, KeyError, BadZipFile: another kind of file, or one that was changed.
    """
    try:
        content = read_bytes(path, MOST_BYTES)
        # It was written unpacked, so one that unpacks to more is forged.
        arrays = read_arrays(content, len(content))
        document, checksum = str(arrays.pop(TREE)), arrays.pop(DIGEST, None)
        if checksum is None:
            raise ValueError("it has no checksum; an earlier version wrote it, or it is damaged")
        if str(checksum) != digest(document, arrays):
            raise ValueError("its checksum does not fit; it was changed or is damaged")
        return _with_arrays(parse_json(document), arrays)
    except Unreadable as error:
        raise ValueError(error.reason) from None


def _without_arrays(value: Tree, arrays: dict[str, npt.NDArray[Any]], place: str) -> Tree:
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (np.ndarray, np.generic)):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise TypeError(f"{place}: an array of objects is not plain")
        name = f"array_{len(arrays)}"
        arrays[name] = array
        return {ARRAY: name}
    if isinstance(value, (list, tuple)):
        return [_without_arrays(item, arrays, f"{place}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _without_arrays(v, arrays, f"{place}.{key}") for key, v in value.items()}
    raise TypeError(f"{place}: {type(value).__name__} is not plain")


def _with_arrays(value: Tree, arrays: Mapping[str, npt.NDArray[Any]]) -> Tree:
    if isinstance(value, list):
        return [_with_arrays(item, arrays) for item in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {ARRAY}:
        return arrays[value[ARRAY]]
    return {key: _with_arrays(item, arrays) for key, item in value.items()}
