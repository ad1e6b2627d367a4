"""ROS 1 and ROS 2 bags, read with `rosbags`: a table for each topic.

`rosbags` makes reading functions from the message definitions in a bag. Only names enter their
text, so every name is checked before (`bag_checks`); nothing of the bag is ever run.
"""

import re
from collections.abc import Callable, Iterator
from keyword import iskeyword
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data.importing.bag_checks import check_bag, check_definition, check_types
from fish_env.data.importing.source import Source, Values, reading
from fish_env.errors import missing_extra

STAMP = "header.stamp"
RECORDED = "recorded"
"""Column of the times at which the messages were written to the bag."""

LONGEST_ARRAY = 32
"""Elements. Longer arrays are pictures and scans."""

PICTURE = 1000
"""Elements of a list from which a message is a picture or a scan."""

_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_STANDARD_UNITS = (
    (re.compile(r"(position|translation|point)\.[xyz]$"), "m"),
    (re.compile(r"(linear|velocity\.linear)\.[xyz]$"), "m/s"),
    (re.compile(r"(angular|angular_velocity)\.[xyz]$"), "rad/s"),
    (re.compile(r"(orientation|rotation)\.[wxyz]$"), "1"),
)

Reader = Callable[[Any], float | int]


def read_bag(path: Path) -> tuple[tuple[Source, ...], tuple[str, ...]]:
    """Reads every topic whose messages hold numbers.

    Args:
        path: A `.bag`, `.db3` or `.mcap` file, or the folder of a ROS 2 bag.

    Returns:
        The topics, and a note for each that could not be read.

    Raises:
        MissingExtraError: rosbags is not installed.
        DatasetError: It is no bag.
    """
    try:
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
    except ImportError:
        raise missing_extra("Reading ROS bags", "rosbags", "logs") from None
    with reading(path, "a ROS bag"):
        check_bag(path)
        ros1 = path.suffix == ".bag"
        with Reader1(path) if ros1 else Reader2(path) as reader:
            return _read_topics(path, reader, ros1)


def _read_topics(path: Path, reader: Any, ros1: bool) -> tuple[tuple[Source, ...], tuple[str, ...]]:
    sources, notes = [], []
    for topic in sorted({connection.topic for connection in reader.connections}):
        connections = [c for c in reader.connections if c.topic == topic]
        kinds = {connection.msgtype for connection in connections}
        if len(kinds) > 1:
            notes.append(f"{path.name}: {topic} left out: it holds messages of {len(kinds)} types")
            continue
        source, note = _read_topic(path, reader, ros1, topic, connections)
        sources += [source] if source is not None else []
        notes += [f"{path.name}: {topic} {note}"] if note else []
    return tuple(sources), tuple(notes)


def _read_topic(
    path: Path, reader: Any, ros1: bool, topic: str, connections: list[Any]
) -> tuple[Source | None, str]:
    kind = connections[0].msgtype
    store = _type_store(path, connections[0], ros1)
    if kind not in store.fielddefs:
        return None, f"left out: the bag does not define its type {kind}"
    decode = store.deserialize_ros1 if ros1 else store.deserialize_cdr
    stamps, values, sample, skipped = list[int](), dict[str, list[float | int]](), None, list[str]()
    leaves: dict[str, Reader] = {}
    for _, stamp, raw in reader.messages(connections=connections):
        message = decode(raw, kind)
        if sample is None:
            sample = message
            leaves, skipped = _leaves(kind, store.fielddefs, message)
            longest = max((len(_getter(name)(message)) for name in skipped), default=0)
            if longest > PICTURE:
                # Such topics may be larger than memory, and hold no channel.
                return None, f"left out: its messages are lists of {longest} elements"
            values = {name: [] for name in leaves}
        stamps.append(stamp)
        for name, read in leaves.items():
            values[name].append(read(message))
    if sample is None:
        return None, "left out: it holds no message"
    columns: dict[str, Values] = {RECORDED: np.array(stamps, dtype=np.int64)}
    columns |= {name: np.array(column) for name, column in values.items()}
    units = {
        name: unit for name in columns for pattern, unit in _STANDARD_UNITS if pattern.search(name)
    }
    units |= {name: "ns" for name in columns if name == RECORDED or name.endswith("stamp")}
    frame = str(getattr(getattr(sample, "header", None), "frame_id", ""))
    note = f"read without {', '.join(skipped)} (lists, pictures, text)" if skipped else ""
    return Source(path, topic, columns, units, kind, frame), note


def _type_store(path: Path, connection: Any, ros1: bool) -> Any:
    """Message types of one topic: as the bag defines them, else as ROS does."""
    from rosbags.interfaces import MessageDefinitionFormat as Format
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    definition = connection.msgdef
    if definition.format == Format.NONE:
        return get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    check_definition(path, connection.msgtype, definition.data)
    types: dict[str, Any] = {}
    if definition.format == Format.MSG:
        types.update(get_types_from_msg(definition.data, connection.msgtype))
    else:
        for part in _idl_parts(definition.data):
            types.update(get_types_from_idl(part))
    store = get_typestore(Stores.EMPTY)
    types = {name: fields for name, fields in types.items() if name not in store.fielddefs}
    check_types(path, types)
    store.register(types)
    return store


def _idl_parts(text: str) -> Iterator[str]:
    line = "=" * 80 + "\n"
    if not text.startswith(f"{line}IDL: "):
        yield text
        return
    for part in text.split(line)[1:]:
        yield part.partition("\n")[2]


def _leaves(
    kind: str, types: dict[str, Any], sample: Any, path: str = ""
) -> tuple[dict[str, Reader], list[str]]:
    """Readers of the numbers in a message by dotted path, and what is left out."""
    leaves, skipped = dict[str, Reader](), list[str]()
    for name, (node, detail) in types[kind][1]:
        here = f"{path}{name}"
        if int(node) == 1 and detail[0] not in ("string", "wstring"):
            leaves[here] = _getter(here)
        elif int(node) == 2 and detail in _TIMES:
            leaves[here] = _nanoseconds(here)
        elif int(node) == 2:
            below, others = _leaves(detail, types, sample, f"{here}.")
            leaves |= below
            skipped += others
        elif int(node) in (3, 4) and "covariance" not in name and int(detail[0][0]) == 1:
            elements = _elements(here, _getter(here)(sample), _labels(sample, path))
            leaves |= elements
            skipped += [] if elements else [here]
        elif int(node) in (3, 4) and "covariance" not in name:
            skipped.append(here)
    return leaves, [name for name in skipped if name != f"{path}name"]


def _getter(path: str) -> Callable[[Any], Any]:
    """Reads a field by its dotted path; rosbags adds a line to names that are words of Python."""
    parts = (f"{part}_" if iskeyword(part) else part for part in path.split("."))
    return attrgetter(".".join(parts))


def _labels(sample: Any, path: str) -> list[str]:
    """Names of the elements, as a JointState gives them."""
    owner = _getter(path[:-1])(sample) if path else sample
    return [str(name) for name in getattr(owner, "name", [])] if _has_list(owner) else []


def _has_list(owner: Any) -> bool:
    return isinstance(getattr(owner, "name", None), list)


def _elements(path: str, sample: Any, labels: list[str]) -> dict[str, Reader]:
    if len(sample) > LONGEST_ARRAY or not isinstance(sample, np.ndarray):
        return {}
    named = labels if len(labels) == len(sample) else [str(i) for i in range(len(sample))]
    return {f"{path}[{label}]": _element(path, i) for i, label in enumerate(named)}


def _element(path: str, index: int) -> Reader:
    get = _getter(path)

    def read(message: Any) -> float:
        values = get(message)
        return float(values[index]) if index < len(values) else float("nan")

    return read


def _nanoseconds(path: str) -> Reader:
    get = _getter(path)

    def read(message: Any) -> int:
        stamp = get(message)
        return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)

    return read
