"""Trees of plain values as one file: arrays in NumPy's archive, the rest as JSON. No pickles.

Reading such a file can run no code: arrays of objects are refused, and JSON holds data alone.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.files import replacing

Tree = Any
"""None, bool, int, float, str, array, list of trees, or mapping from str to trees."""
TREE, ARRAY = "tree", "__array__"


def write_plain(tree: Tree, path: Path) -> None:
    """Writes a tree; the file is there whole or not at all.

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
        np.savez(stream, **{TREE: np.array(document)}, **arrays)  # type: ignore[arg-type]


def read_plain(path: Path) -> Tree:
    """Reads what :func:`write_plain` wrote.

    Raises:
        OSError, ValueError, KeyError, BadZipFile: it is no such file, or damaged.
    """
    if not zipfile.is_zipfile(path):
        raise ValueError("no archive of arrays")
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    foreign = [name for name, value in arrays.items() if not isinstance(value, np.ndarray)]
    if foreign:
        raise ValueError(f"{foreign[0]} is no array")
    return _with_arrays(json.loads(str(arrays[TREE])), arrays)


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
