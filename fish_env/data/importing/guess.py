"""A mapping guessed from names, message types and values, with every guess in words."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from fish_env.data.importing.kinds import Kind, find_kinds, guess_time, without_time
from fish_env.data.importing.names import (
    CHANNEL_NAMES,
    COMMAND_NAMES,
    COMMANDING,
    COMPASS,
    GEOGRAPHIC,
    PLANAR,
    RUN_NAMES,
    UPWARD,
    command_name,
    take_apart,
)
from fish_env.data.importing.plan import FORMAT, Content
from fish_env.data.importing.source import Source
from fish_env.data.importing.stamps import TimeColumn
from fish_env.data.importing.unit_guess import guess_units
from fish_env.data.vocabulary import COMMANDS, QUATERNION

_GROUPS = (
    ("x", "y", "z"),
    ("depth",),
    (*QUATERNION, "roll", "pitch", "yaw"),
    ("u", "v", "w"),
    ("p", "q", "r"),
    ("tail_angle",),
)
"""Channels that are taken from one table together."""
_WORLD = ("map", "odom", "world", "earth", "mocap", "ned", "enu", "vicon", "optitrack")
"""Words in `header.frame_id` that tell of a frame which does not move with the fish."""
_MEASURED_TOO = frozenset(["servo", "set"])
_BLOCK = ("block_displacement", "block_angle")


@dataclass(frozen=True)
class Candidate:
    """A column that may be a channel or a command.

    Attributes:
        kind: Its table, and those like it.
        column: Its name.
        sign: -1 where it grows the other way.
        frame: The frame its name tells of, or empty.
    """

    kind: Kind
    column: str
    sign: int = 1
    frame: str = ""


UNKNOWN_START = "start and tail_phase: estimated from each run, unless --start rest is given"


@dataclass(frozen=True)
class Guess:
    """A guessed mapping.

    Attributes:
        content: The mapping, which may lack what could not be guessed.
        assumptions: Each guess in words.
        left_out: Columns that are mapped to nothing, in words for each table.
    """

    content: Content
    assumptions: tuple[str, ...]
    left_out: tuple[str, ...]


def guess_mapping(
    sources: Sequence[Source], name: str, fish: str | None = None, frame: str | None = None
) -> Guess:
    """Guesses what the columns of some logs mean.

    Args:
        sources: All tables of the logs.
        name: Name of the dataset.
        fish: Preset or absolute path of the fish, if it was told.
        frame: "ned" or "enu", if it was told.

    Returns:
        The mapping, and every guess in words. What there is no evidence for is left out of it.

    Raises:
        DatasetError: No table has a column of times that can be read.
    """
    said = list[str]()
    kinds = find_kinds(sources)
    times = {kind.name: found for kind in kinds if (found := guess_time(kind)) is not None}
    if kinds and not times:
        raise without_time(kinds[0])
    timed = [kind for kind in kinds if kind.name in times]
    commands = _choose_commands(timed, said)
    channels = _choose_channels(timed, commands.values(), said)
    frame = frame or _guess_frame(channels, said)
    channels = {n: _in_frame(n, c, frame, said) for n, c in channels.items()}
    chosen = {**channels, **commands}
    used = [kind for kind in timed if any(c.kind is kind for c in chosen.values())]
    units = guess_units(
        {n: (c.kind, c.column) for n, c in chosen.items()},
        {kind.name: times[kind.name][0] for kind in used},
        said,
    )
    said += [_time_words(kind, *times[kind.name]) for kind in used]
    run_column = _guess_run_column(used, said)
    content: Content = {
        "format": FORMAT,
        "name": name,
        **({"fish": fish} if fish else {}),
        **({"frame": frame} if frame else {}),
        "start": "unknown",
        "tail_phase": "unknown",
        **({"run_column": run_column} if run_column else {}),
        "sources": {kind.name: _source(kind, times[kind.name][0]) for kind in timed},
        "channels": {n: _entry(c, units[n], frame) for n, c in channels.items()},
        "commands": {n: _entry(c, units[n], frame) for n, c in commands.items()},
        "constant_commands": _guess_constants(commands, said),
    }
    if commands:
        said.append("a command holds until the next (between: hold; or linear)")
    said.append(UNKNOWN_START)
    return Guess(content, tuple(said), _left_out(kinds, chosen.values(), times, run_column))


def _entry(candidate: Candidate, unit: str, frame: str | None) -> Content:
    entry: Content = {"source": candidate.kind.name, "column": candidate.column, "unit": unit}
    entry |= {"sign": -1} if candidate.sign < 0 else {}
    return entry | ({"frame": candidate.frame} if candidate.frame not in ("", frame) else {})


def _source(kind: Kind, time: TimeColumn) -> Content:
    return {
        **({"files": kind.files} if kind.files != "*" else {}),
        **({"part": kind.part} if kind.part else {}),
        "time": {"column": time.column, "unit": time.unit},
    }


def _time_words(kind: Kind, time: TimeColumn, how: str) -> str:
    more = f" and {len(kind.tables) - 1} like it" if len(kind.tables) > 1 else ""
    return (
        f"source {kind.name}: {kind.first.name}{more}; its time is '{time.column}', unit "
        f"{time.unit} ({how})"
    )


def _choose_channels(
    kinds: Sequence[Kind], commands: Iterable[Candidate], said: list[str]
) -> dict[str, Candidate]:
    taken = {(c.kind.name, c.column) for c in commands}
    found: dict[str, dict[str, Candidate]] = {}
    for kind in kinds:
        for name, candidate in _channel_candidates(kind):
            if (kind.name, candidate.column) not in taken:
                found.setdefault(kind.name, {}).setdefault(name, candidate)
    for candidates in found.values():
        _read_planar_pose(candidates, said)
    chosen: dict[str, Candidate] = {}
    for group in _GROUPS:
        chosen |= _choose_group(group, found, chosen, said)
    return {name: chosen[name] for group in _GROUPS for name in group if name in chosen}


def _read_planar_pose(found: dict[str, Candidate], said: list[str]) -> None:
    """Makes theta the yaw in a table with x, y and theta alone, as in ROS's Pose2D."""
    theta = found.get("pitch")
    if theta is None or not PLANAR.fullmatch(take_apart(theta.column).bare):
        return
    if {"x", "y"} <= found.keys() and not {"z", "depth", "roll", "yaw"} & found.keys():
        found["yaw"] = found.pop("pitch")
        said.append(f"yaw: '{theta.column}', as the table has x, y and no other angle")


def _choose_group(
    group: Sequence[str],
    found: Mapping[str, Mapping[str, Candidate]],
    chosen: Mapping[str, Candidate],
    said: list[str],
) -> dict[str, Candidate]:
    """Takes a group of channels from the table that has most of it, the one with x at a tie."""
    mine = {}
    for kind, candidates in found.items():
        of_group = {name: candidates[name] for name in group if name in candidates}
        whole = all(name in of_group for name in QUATERNION)
        drop = ("roll", "pitch", "yaw") if whole else QUATERNION
        of_group = {name: c for name, c in of_group.items() if name not in drop}
        if of_group:
            mine[kind] = of_group
    if not mine:
        return {}
    place = chosen["x"].kind.name if "x" in chosen else ""
    best = max(
        mine,
        key=lambda kind: (
            kind == place and len(group) > 3,
            len(mine[kind]),
            len(next(iter(mine[kind].values())).kind.first),
        ),
    )
    for kind, other in mine.items():
        if kind != best:
            said.append(f"{', '.join(other)} of source {kind} not used: {best} has them too")
    return mine[best]


def _channel_candidates(kind: Kind) -> Iterator[tuple[str, Candidate]]:
    source = kind.first
    asked = set(take_apart(source.part.strip("/")).bare.split("_"))
    world = any(word in source.frame_id.lower() for word in _WORLD)
    for column in source.columns:
        bare = take_apart(column).bare
        if not source.is_numeric(column) or (COMMANDING - _MEASURED_TOO) & (
            asked | set(bare.split("_"))
        ):
            continue
        for name, pattern in CHANNEL_NAMES.items():
            moving = name in ("u", "v", "w", "p", "q", "r")
            if moving and world and "Twist" in source.kind:
                continue  # velocities along axes that do not move with the fish
            if pattern.fullmatch(bare):
                yield name, Candidate(kind, column)
        if UPWARD.fullmatch(bare):
            yield "z", Candidate(kind, column, frame="up")


def _choose_commands(kinds: Sequence[Kind], said: list[str]) -> dict[str, Candidate]:
    ranked: dict[str, list[tuple[bool, int, Candidate]]] = {}
    for kind in kinds:
        matches = list(_command_candidates(kind))
        for name, asked, candidate in matches:
            ranked.setdefault(name, []).append((asked, len(matches), candidate))
    chosen = {}
    for name in COMMANDS:
        if name not in ranked:
            continue
        best = max(ranked[name], key=lambda each: each[:2])
        chosen[name] = best[2]
        others = [c for _, _, c in ranked[name] if c is not best[2]]
        said += [
            f"{name}: '{c.column}' of source {c.kind.name} not used; '{best[2].column}' is"
            for c in others
        ]
    return chosen


def _command_candidates(kind: Kind) -> Iterator[tuple[str, bool, Candidate]]:
    for column in kind.first.columns:
        words, asked = command_name(kind.first.part, column)
        for name, pattern in COMMAND_NAMES.items():
            if pattern.fullmatch(words) and kind.first.is_numeric(column):
                yield name, asked, Candidate(kind, column)


def _guess_frame(channels: Mapping[str, Candidate], said: list[str]) -> str | None:
    """The frame that names or message types tell of; None where nothing does."""
    columns = [(name, c, take_apart(c.column).bare) for name, c in channels.items()]
    if any(GEOGRAPHIC.fullmatch(bare) for _, _, bare in columns):
        said.append("frame ned, as columns are called north, east or down")
        return "ned"
    messages = [c.kind.first for _, c, _ in columns if c.kind.first.kind]
    if messages:
        ned = next((m.frame_id for m in messages if "ned" in m.frame_id.lower()), None)
        if ned:
            said.append(f"frame ned, as frame_id is '{ned}'")
            return "ned"
        said.append("frame enu (body: forward, port, up), as ROS defines it (REP 103)")
        return "enu"
    up = next((c.column for _, c, _ in columns if c.frame == "up"), None)
    if up is not None:
        said.append(f"frame enu, as there is a column '{up}'")
        return "enu"
    return None


def _in_frame(name: str, candidate: Candidate, frame: str | None, said: list[str]) -> Candidate:
    """A candidate whose name tells of a frame, seen from the frame of the dataset."""
    bare = take_apart(candidate.column).bare
    if candidate.frame == "up":
        sign = -1 if frame == "ned" else 1
        return replace(candidate, frame="", sign=sign)
    if frame == "enu" and (COMPASS.fullmatch(bare) or GEOGRAPHIC.fullmatch(bare)):
        said.append(f"{name}: '{candidate.column}' read in frame ned, from north and clockwise")
        return replace(candidate, frame="ned")
    return candidate


def _guess_run_column(kinds: Sequence[Kind], said: list[str]) -> str | None:
    for column in kinds[0].first.columns if kinds else ():
        everywhere = all(column in table.columns for kind in kinds for table in kind.tables)
        if RUN_NAMES.fullmatch(take_apart(column).bare) and everywhere:
            said.append(f"column '{column}' separates the runs")
            return column
    return None


def _guess_constants(commands: Mapping[str, Candidate], said: list[str]) -> Content:
    absent = [name for name in _BLOCK if name not in commands]
    if absent:
        said.append(f"{' and '.join(absent)}: held at 0, as no column is called so")
    return dict.fromkeys(absent, 0.0)


def _left_out(
    kinds: Sequence[Kind],
    chosen: Iterable[Candidate],
    times: Mapping[str, tuple[TimeColumn, str]],
    run_column: str | None,
) -> tuple[str, ...]:
    used = {(c.kind.name, c.column) for c in chosen}
    words = []
    for kind in kinds:
        time = times[kind.name][0].column if kind.name in times else None
        rest = [c for c in kind.first.columns if (kind.name, c) not in used]
        rest = [c for c in rest if c not in (time, run_column, "recorded")]
        if time is None:
            words.append(f"{kind.first.name}: no column of times is recognised in it")
        if rest:
            words.append(f"{kind.first.name}: not used: {', '.join(rest)}")
    return tuple(words)
