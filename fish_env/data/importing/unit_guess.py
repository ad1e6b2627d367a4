"""Units of mapped columns: as the file states them, else guessed from the values, in words."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.importing.kinds import Kind
from fish_env.data.importing.names import take_apart
from fish_env.data.importing.stamps import TimeColumn
from fish_env.data.place import Place
from fish_env.data.plausibility import FASTEST_TURNING, TRAVEL_INTERVAL, YAW_INTERVAL
from fish_env.data.units import parse_unit, unit_root
from fish_env.data.vocabulary import COMMANDS, FILE_CHANNELS, QUATERNION, RATE_LIMIT, Quantity
from fish_env.errors import DatasetError

USUAL_SPEED = 0.1
"""m/s. What most robotic fish are nearest to, among the speeds that m, cm and mm would make."""
_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_LARGEST = {"roll": math.pi, "pitch": math.pi / 2, "yaw": 2.0 * math.pi, "tail_angle": math.pi}
_KNOWN: Mapping[str, Quantity] = {**FILE_CHANNELS, **COMMANDS}

Chosen = Mapping[str, tuple[Kind, str]]


def guess_units(chosen: Chosen, times: Mapping[str, TimeColumn], said: list[str]) -> dict[str, str]:
    """Finds the unit of each mapped column.

    Args:
        chosen: Table and column of each channel and command.
        times: Time column of each kind of table.
        said: Takes each guess in words.

    Returns:
        Unit by channel and command.
    """
    units = {name: "1" for name in QUATERNION if name in chosen}
    stated: dict[str, list[str]] = {}
    for name, (kind, column) in chosen.items():
        unit = kind.first.units.get(column) or take_apart(column).unit
        if name not in units and unit and _measures(unit, _KNOWN[name]):
            units[name] = unit
            by_type = kind.first.kind and column in kind.first.units
            who = "ROS defines them" if by_type else "the columns say"
            stated.setdefault(who, []).append(f"{name} {unit}")
        elif name not in units and unit:
            said.append(f"{name}: the unit '{unit}' of '{column}' is unknown or does not fit")
    said += [f"units as {who}: {', '.join(names)}" for who, names in stated.items()]
    open_ones = {name: place for name, place in chosen.items() if name not in units}
    for group in _groups(open_ones):
        values = {name: _values(*open_ones[name]) for name in group}
        kind = open_ones[group[0]][0]
        degrees = any(unit.startswith("deg") for unit in units.values())
        unit, why = _guess(values, _times(kind, times[kind.name]), degrees)
        units |= dict.fromkeys(group, unit)
        said.append(f"{', '.join(group)}: unit {unit} assumed ({why})")
    return units


def _measures(unit: str, quantity: Quantity) -> bool:
    try:
        parse_unit(unit, quantity, Place(Path()))
    except DatasetError:
        return False
    return True


def _groups(chosen: Chosen) -> list[list[str]]:
    """Channels of one kind of table and one dimension, which share a unit; angles first."""
    groups: dict[tuple[str, str, bool], list[str]] = {}
    for name, (kind, _) in chosen.items():
        key = (kind.name, _KNOWN[name].dimension, name in COMMANDS)
        groups.setdefault(key, []).append(name)
    return [groups[key] for key in sorted(groups, key=lambda key: key[1])]


def _values(kind: Kind, column: str) -> FloatArray:
    return np.concatenate([table.numbers(column) for table in kind.tables])


def _times(kind: Kind, time: TimeColumn) -> FloatArray:
    """Times of all tables in a row, s; NaN where they are text."""
    columns = [table.column(time.column) for table in kind.tables]
    root = unit_root(time.unit)
    if root is None or any(column.dtype == object for column in columns):
        return np.full(sum(map(len, columns)), np.nan)
    return np.concatenate([column.astype(np.float64) for column in columns]) * root[0]


def _guess(values: Mapping[str, FloatArray], time: FloatArray, degrees: bool) -> tuple[str, str]:
    dimension = _KNOWN[next(iter(values))].dimension
    if dimension == "angle":
        return _guess_angle(values, time)
    if dimension == "rate":
        return _guess_rate(values, degrees)
    if dimension == "frequency":
        return "Hz", "usual for a frequency"
    if dimension == "speed":
        return _nearest([_size(a) for a in values.values()], "median size")
    return _guess_length(values, time)


def _guess_angle(values: Mapping[str, FloatArray], time: FloatArray) -> tuple[str, str]:
    for name, angle in values.items():
        most = _LARGEST.get(name, _KNOWN[name].upper) * 1.02
        largest = float(np.nanmax(np.abs(angle), initial=0.0))
        if largest > most:
            return "deg", f"{name} reaches {largest:.3g}"
        fast = _rate_of_change(angle, time, YAW_INTERVAL)
        if name not in COMMANDS and fast > FASTEST_TURNING:
            return "deg", f"{name} would turn at {fast:.3g} rad/s"
    largest = max(float(np.nanmax(np.abs(a), initial=0.0)) for a in values.values())
    return "rad", f"nothing beyond {largest:.3g}"


def _guess_rate(values: Mapping[str, FloatArray], degrees: bool) -> tuple[str, str]:
    for name, rate in values.items():
        size = np.abs(rate[np.isfinite(rate)])
        if size.size and (size.max() > RATE_LIMIT or np.quantile(size, 0.9) > FASTEST_TURNING):
            return "deg/s", f"{name} reaches {size.max():.3g}"
    if degrees:
        return "deg/s", "the angles are in degrees"
    return "rad/s", "no value that only degrees explain"


def _guess_length(values: Mapping[str, FloatArray], time: FloatArray) -> tuple[str, str]:
    if next(iter(values)) in COMMANDS:
        largest = max(float(np.nanmax(np.abs(a), initial=0.0)) for a in values.values())
        return ("m" if largest <= 0.5 else "mm"), f"nothing beyond {largest:.3g}"
    speeds = [_rate_of_change(a, time, TRAVEL_INTERVAL) for a in values.values()]
    if np.isfinite(speeds).any() and np.nanmax(speeds) > 0.0:
        return _nearest(speeds, "speed of nine tenths of the samples")
    return "m", "usual for a position"


def _nearest(sizes: Sequence[float], what: str) -> tuple[str, str]:
    size = float(np.nanmax(sizes)) if np.isfinite(sizes).any() else 0.0
    suffix = "/s" if what.startswith("median") else ""
    if size <= 0.0:
        return f"m{suffix}", "usual"
    unit = min(_LENGTHS, key=lambda u: abs(math.log10(size * _LENGTHS[u] / USUAL_SPEED)))
    return f"{unit}{suffix}", f"{what} {size * _LENGTHS[unit]:.3g} m/s"


def _size(values: FloatArray) -> float:
    return float(np.nanmedian(np.abs(values))) if np.isfinite(values).any() else math.nan


def _rate_of_change(values: FloatArray, time: FloatArray, interval: float) -> float:
    """Rate that a tenth of the samples exceed, over steps of about an interval, s."""
    present = np.isfinite(values) & np.isfinite(time)
    values, time = values[present], time[present]
    if values.size < 3:
        return math.nan
    usual = float(np.median(np.abs(np.diff(time)))) or 1.0
    step = max(1, min(round(interval / usual), values.size // 2))
    elapsed = time[step:] - time[:-step]
    moved = np.abs(values[step:] - values[:-step])
    # Between runs time goes back, and a wrapped angle jumps.
    fine = (elapsed > 0.0) & (elapsed < 4.0 * step * usual)
    return float(np.quantile(moved[fine] / elapsed[fine], 0.9)) if fine.any() else math.nan
