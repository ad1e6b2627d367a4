"""MATLAB files, of versions 5 to 7 with scipy and of version 7.3 with h5py: data only.

Either becomes a tree of arrays as MATLAB shows them: structs are dictionaries, struct arrays lists
of them. Objects, function handles and cells are left out with a note; nothing is ever unpickled or
run, and no other file is opened.
"""

import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data.importing import limits, matlab_checks
from fish_env.data.importing.source import Source, Values, reading
from fish_env.data.place import Place
from fish_env.errors import missing_extra

Tree = dict[str, Any]

WIDEST = 16
"""Columns of a matrix. A wider one is a picture or a table of something else."""
MOST_OBJECTS = 10_000
"""Variables, structs and elements of struct arrays in one file of version 7.3."""
_HDF5 = b"MATLAB 7.3"


def read_matlab(file: Path) -> tuple[tuple[Source, ...], tuple[str, ...]]:
    """Reads the variables of a `.mat` file: a table for each struct, one for loose vectors.

    Args:
        file: The file.

    Returns:
        The tables, and a note for each variable that was left out.

    Raises:
        MissingExtraError: The file is of version 7.3 and h5py is not installed.
        DatasetError: It is no such file.
    """
    with reading(file, "a MATLAB file"):
        with file.open("rb") as stream:
            head = stream.read(matlab_checks.HEADER)
        newer = head.startswith(_HDF5) or head.startswith(b"\x89HDF")
        tree, notes = _read_hdf5(file) if newer else _read_version_5(file)
        sources = tuple(_sources(file, tree, "", notes))
    if not sources:
        raise Place(file).refuse(
            "it holds no vectors of numbers", "Save vectors, or a struct of vectors: save -struct"
        )
    return sources, tuple(f"{file.name}: {note}" for note in notes)


def _read_version_5(file: Path) -> tuple[Tree, list[str]]:
    from scipy.io import loadmat

    raw = limits.content(file, matlab_checks.MOST_UNPACKED)
    if 0 not in raw[:4]:  # a file of version 4 begins with a small number
        matlab_checks.check(raw)
    content = loadmat(io.BytesIO(raw), simplify_cells=True)
    # Matrices keep their shape; simplify_cells would drop an axis of length one.
    return {name: value for name, value in content.items() if not name.startswith("__")}, []


def _read_hdf5(file: Path) -> tuple[Tree, list[str]]:
    try:
        import h5py
    except ImportError:
        raise missing_extra("Reading MATLAB 7.3 files", "h5py", "logs") from None
    with h5py.File(file, "r") as opened:
        walk = _Walk(opened)
        tree = _group(opened, walk, "")
        return (tree if isinstance(tree, dict) else {}), walk.notes


@dataclass
class _Walk:
    """What was met on the way through one HDF5 file.

    Its links may lead to one object many times, and in circles.

    Attributes:
        root: The file.
        notes: What was left out.
        objects: Objects met, each as often as it was.
        values: Numbers read.
        depth: Of the group or reference that is being read.
    """

    root: Any
    notes: list[str] = field(default_factory=list)
    objects: int = 0
    values: int = 0
    depth: int = 0

    def meet(self, values: int = 0) -> None:
        """Counts an object, and its values if it is read.

        Raises:
            ValueError: There are too many.
        """
        self.objects += 1
        self.values += values
        if self.objects > MOST_OBJECTS or self.values > limits.MOST_VALUES:
            raise ValueError(
                f"more than {MOST_OBJECTS:,} variables or {limits.MOST_VALUES:,} values, what "
                "several links lead to counted for each; save fewer variables"
            )
        if self.depth > limits.DEEPEST:
            raise ValueError(f"structs nested more than {limits.DEEPEST} levels deep")


class _Elements(list[Any]):
    """The values of one field of a struct array, one for each of its elements."""


def _group(group: Any, walk: _Walk, path: str) -> Any:
    """The content of one HDF5 group; links that lead elsewhere are not followed."""
    import h5py

    tree: Tree = {}
    walk.meet()
    walk.depth += 1
    for name in group:
        here = f"{path}{name}"
        if name.startswith("#"):
            continue
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            walk.notes.append(f"{here} left out: it is a link")
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            tree[name] = _group(item, walk, f"{here}.")
        elif (value := _dataset(item, walk, here)) is not None:
            tree[name] = value
    walk.depth -= 1
    return _transposed_structs(tree)


def _dataset(item: Any, walk: _Walk, path: str) -> Any:
    import h5py

    kind = item.attrs.get("MATLAB_class", b"double")
    if "MATLAB_empty" in item.attrs or kind == b"char":
        return None
    if item.external or item.is_virtual:
        walk.notes.append(f"{path} left out: its data lie in another file")
        return None
    if h5py.check_ref_dtype(item.dtype) is h5py.Reference and kind != b"cell":
        return _referred(item, walk, path)
    if item.dtype.kind not in "fiub":
        walk.notes.append(f"{path} left out: {_text(kind)} holds no plain numbers")
        return None
    walk.meet(item.size or 0)
    return np.asarray(item[()]).T


def _referred(item: Any, walk: _Walk, path: str) -> _Elements:
    """The field of a struct array: one reference for each element."""
    walk.meet(item.size)
    walk.depth += 1
    found = [walk.root[reference] for reference in np.ravel(item[()])]
    values = [_dataset(one, walk, path) if hasattr(one, "dtype") else None for one in found]
    walk.depth -= 1
    return _Elements(values)


def _text(kind: Any) -> str:
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)


def _transposed_structs(tree: Tree) -> Any:
    """A list of structs where every field has elements, as a struct array is stored."""
    lists = {name: value for name, value in tree.items() if isinstance(value, _Elements)}
    if not lists or len(lists) < len(tree) or len({len(one) for one in lists.values()}) > 1:
        return {name: value for name, value in tree.items() if name not in lists}
    return [
        {name: values[i] for name, values in lists.items() if values[i] is not None}
        for i in range(len(next(iter(lists.values()))))
    ]


def _sources(file: Path, tree: Tree, path: str, notes: list[str]) -> Iterator[Source]:
    """A table for each length of vectors in a struct, then the structs within it."""
    columns: dict[int, dict[str, Values]] = {}
    for name, value in tree.items():
        here = f"{path}{name}"
        structs = _structs(value)
        if structs is not None:
            for i, struct in enumerate(structs):
                number = f"({i + 1})" if len(structs) > 1 or not isinstance(value, dict) else ""
                yield from _sources(file, struct, f"{here}{number}.", notes)
            continue
        found = _columns(name, value)
        if found is None:
            notes.append(f"{here} left out: it is not a vector or narrow matrix of numbers")
        for column, values in (found or {}).items():
            columns.setdefault(len(values), {})[column] = values
    for length, group in sorted(columns.items()):
        several = f"[{length} rows]" if len(columns) > 1 else ""
        yield Source(file, f"{path.rstrip('.')}{several}", group)


def _structs(value: Any) -> list[Tree] | None:
    if isinstance(value, dict):
        return [value]
    items = (
        list(value.ravel())
        if isinstance(value, np.ndarray) and value.dtype == object
        else (value if isinstance(value, list) else [])
    )
    return items if items and all(isinstance(item, dict) for item in items) else None


def _columns(name: str, value: Any) -> dict[str, Values] | None:
    """Vectors of a variable by the way MATLAB writes them; scalars and text have none."""
    if isinstance(value, str | int | float | bool | np.generic) or value is None:
        return {}
    array = np.asarray(value)
    if array.size <= 1 or (array.dtype.kind == "U" and array.ndim == 1):
        return {}
    if array.dtype.kind not in "fiub" or array.ndim > 2:
        return None
    if array.ndim == 1 or 1 in array.shape:
        return {name: _values(array.ravel())}
    if min(array.shape) > WIDEST:
        return None
    if array.shape[0] >= array.shape[1]:
        return {f"{name}(:,{i + 1})": _values(column) for i, column in enumerate(array.T)}
    return {f"{name}({i + 1},:)": _values(row) for i, row in enumerate(array)}


def _values(array: Any) -> Values:
    return np.asarray(array, dtype=np.int64 if array.dtype.kind in "iu" else np.float64)
