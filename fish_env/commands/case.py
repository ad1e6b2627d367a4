"""Reading of a case: one simulation described in a JSON file.

Keys: `fish` (a preset, or a path relative to the file), `duration_s`, `schedule` (rows of `t` and
commands), and optionally `initial` and `effects`. Anything else is refused by name.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fish_env.data.schema import CommandSteps
from fish_env.errors import ParameterError, ScheduleError
from fish_env.files import STANDARD
from fish_env.params import FishParams, list_fish, load_fish
from fish_env.reading import (
    Unreadable,
    is_number,
    located,
    parse_json,
    read_json,
    read_standard_input,
    short,
)
from fish_env.simulator import InitialState, schedule

REQUIRED = ("fish", "duration_s", "schedule")
OPTIONAL = ("initial", "effects")
INITIAL_VECTORS = {
    "position_inertial": "position",
    "euler_roll_pitch_yaw": "euler",
    "velocity_body": "velocity_body",
    "angular_velocity_body": "angular_velocity_body",
}
"""Key in a case -> field of :class:`fish_env.simulator.InitialState`."""


@dataclass(frozen=True)
class Case:
    """One simulation.

    Attributes:
        fish: The parameters.
        duration_s: Length, s.
        commands: What is asked of the actuators.
        initial: State at the start.
        effects: Effects beside those in the fish's file: name -> parameters.
    """

    fish: FishParams
    duration_s: float
    commands: CommandSteps
    initial: InitialState
    effects: Mapping[str, Mapping[str, float]]


def read_case(file: Path, trust_effects: bool = False) -> Case:
    """Reads a case.

    Args:
        file: The case; `-` is standard input, paths in it are then relative to this folder.
        trust_effects: Let its simulation run the effect files that the fish's file names.

    Raises:
        ScheduleError: The file is missing, is no JSON, or a key or value is not as it should be;
            names the file, the key and the remedy.
        ParameterError: The fish is unknown or impossible.
    """
    data = _read_json(file)
    _check_keys(data, REQUIRED, OPTIONAL, str(file))
    return Case(
        fish=_fish(data["fish"], file, trust_effects),
        duration_s=_number(data["duration_s"], f"{file}: duration_s"),
        commands=_commands(data["schedule"], file),
        initial=_initial(data.get("initial"), f"{file}: initial"),
        effects=_effects(data.get("effects"), f"{file}: effects"),
    )


def _read_json(file: Path) -> Mapping[str, Any]:
    try:
        standard = str(file) == STANDARD
        data = parse_json(read_standard_input()) if standard else read_json(file)
    except FileNotFoundError:
        raise ScheduleError(f"{file}: no such file; check the path") from None
    except Unreadable as error:
        raise ScheduleError(f"{file}: {error}") from error
    return _mapping(data, str(file))


def _mapping(data: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(data, dict):
        raise ScheduleError(f"{where}: expected an object {{...}}, got {_shown(data)}")
    return data


def _check_keys(
    data: Mapping[str, Any], required: Iterable[str], optional: Iterable[str], where: str
) -> None:
    known = [*required, *optional]
    for key in data:
        if key not in known:
            near = difflib.get_close_matches(short(key), known, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"known keys: {', '.join(known)}"
            raise ScheduleError(f"{where}: unknown key '{short(key)}'; {hint}")
    for key in required:
        if key not in data:
            raise ScheduleError(f"{where}: the key '{key}' is missing; add it")


def _fish(name: Any, file: Path, trust_effects: bool) -> FishParams:
    if not isinstance(name, str):
        raise ScheduleError(f"{file}: fish: expected a preset's name or a path, got {_shown(name)}")
    try:
        beside = located(name, file.parent)
    except Unreadable as error:
        raise ScheduleError(f"{file}: fish: {error}") from None
    # A name without an ending that is no file is a misspelt preset: load_fish suggests the nearest.
    is_path = name not in list_fish() and (beside.is_file() or beside.suffix in (".yaml", ".yml"))
    try:
        return load_fish(beside if is_path else name, trust_effects)
    except ParameterError as error:
        raise ParameterError(f"{file}: fish: {error}") from error


def _commands(rows: Any, file: Path) -> CommandSteps:
    if not isinstance(rows, list):
        raise ScheduleError(f"{file}: schedule: expected a list of rows, got {_shown(rows)}")
    checked = [_numbers(row, f"{file}: schedule[{i}]") for i, row in enumerate(rows)]
    try:
        return schedule(checked)
    except ScheduleError as error:
        raise ScheduleError(f"{file}: {error}") from error


def _initial(data: Any, where: str) -> InitialState:
    if data is None:
        return InitialState()
    given = _mapping(data, where)
    _check_keys(given, (), (*INITIAL_VECTORS, "tail_phase"), where)
    vectors = {
        field: _vector(given[key], f"{where}.{key}")
        for key, field in INITIAL_VECTORS.items()
        if key in given
    }
    phase = _number(given.get("tail_phase", 0.0), f"{where}.tail_phase")
    return InitialState(**vectors, tail_phase=phase)


def _effects(data: Any, where: str) -> dict[str, dict[str, float]]:
    named = _mapping({} if data is None else data, where)
    return {name: _numbers(values, f"{where}.{short(name)}") for name, values in named.items()}


def _vector(data: Any, where: str) -> tuple[float, float, float]:
    if not isinstance(data, list) or len(data) != 3:
        raise ScheduleError(f"{where}: expected three numbers, got {_shown(data)}")
    x, y, z = (_number(value, f"{where}[{i}]") for i, value in enumerate(data))
    return x, y, z


def _numbers(data: Any, where: str) -> dict[str, float]:
    given = _mapping(data, where)
    return {key: _number(value, f"{where}.{short(key)}") for key, value in given.items()}


def _number(value: Any, where: str) -> float:
    if not is_number(value):
        raise ScheduleError(f"{where}: expected a finite number, got {_shown(value)}")
    return float(value)


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 40 else f"{text[:37]}..."
