"""Refusal of values that cannot be what their unit says."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fish_env.arrays import FloatArray
from fish_env.data.place import Place
from fish_env.data.units import Unit
from fish_env.data.vocabulary import Quantity

FASTEST_TURNING = 4.0 * math.pi
"""rad/s. Two turns a second, kept up for a tenth of a run, is beyond any robotic fish."""

WINDING_RATE = 2.0 * math.pi
"""rad/s. Mean rate at which a yaw may wind on, one turn a second."""

WINDING_START = 4.0 * math.pi
"""rad. How far a yaw may already have wound when a run begins."""

YAW_INTERVAL = 0.1
"""s. Yaw is differenced over at least this time, so that noise does not look like turning."""

FASTEST_TRAVEL, TRAVEL_INTERVAL = 5.0, 0.5
"""m/s, and s over which it is taken. No robotic fish of this kind comes near it."""

LITTLE_WAY, LONG_ENOUGH = 2.0, 3.0
"""m and s. A fish that swims for so long in a tank of a few metres covers more than a thousandth
of the way, but a way in metres read as millimetres does not."""


def check_range(
    values: FloatArray, quantity: Quantity, unit: Unit, rows: list[int], place: Place
) -> None:
    """Refuses values outside the range of their quantity.

    Args:
        values: SI, shape (n,), NaN where missing.
        quantity: What they measure.
        unit: The unit of the file.
        rows: Line of the file of each value.
        place: The file, run and column.

    Raises:
        DatasetError: At the first value outside.
    """
    outside = np.flatnonzero((values < quantity.lower) | (values > quantity.upper))
    if outside.size:
        raise refuse_value(float(values[outside[0]]), quantity, unit, place.at(rows[outside[0]]))


def check_value(value: float, quantity: Quantity, unit: Unit, place: Place) -> None:
    """Refuses one value, SI, outside the range of its quantity.

    Raises:
        DatasetError: It is outside.
    """
    if not quantity.lower <= value <= quantity.upper:
        raise refuse_value(value, quantity, unit, place)


def refuse_value(value: float, quantity: Quantity, unit: Unit, place: Place) -> Exception:
    """Words the error for a value outside its quantity's range; the caller raises it."""
    lower, upper = quantity.lower / unit.factor, quantity.upper / unit.factor
    if quantity.lower == 0.0 and value < 0.0:
        return place.refuse(f"{value / unit.factor:.6g} {unit.name} is negative", "Correct it")
    reason = f"{value / unit.factor:.6g} {unit.name} is outside {lower:.4g} to {upper:.4g}"
    if unit.name in ("rad", "rad/s"):
        return _refuse_degrees(reason, unit, place)
    return place.refuse(reason, f"Correct it, or the unit '{unit.name}' that is declared for it")


def check_turning(
    time_s: FloatArray, yaw: FloatArray, unit: Unit, rows: list[int], place: Place
) -> None:
    """Refuses a yaw in radians that can only be degrees, although a yaw may wind on.

    Args:
        time_s: Sample times, shape (n,), s.
        yaw: Yaw, shape (n,), rad, wrapped or not, NaN where missing.
        unit: The unit of the file; degrees are not questioned.
        rows: Line of the file of each sample.
        place: The file, run and column.

    Raises:
        DatasetError: The yaw has wound further than a fish can turn, or changes faster.
    """
    if unit.name != "rad":
        return
    measured = np.flatnonzero(np.isfinite(yaw))
    time, angle = time_s[measured] - time_s[0], yaw[measured]
    wound = np.flatnonzero(np.abs(angle) > WINDING_START + WINDING_RATE * time)
    if wound.size:
        turns = abs(angle[wound[0]]) / (2.0 * math.pi)
        reason = f"{angle[wound[0]]:.6g} rad is {turns:.1f} turns, more than a fish makes by then"
        remedy = ", or subtract the whole turns it had made before the run"
        raise _refuse_degrees(reason, unit, place.at(rows[measured[wound[0]]]), remedy)
    rate, first = _turning_rate(time, angle)
    check_rate(rate, unit, [rows[index] for index in measured[first]], place, or_clock(time_s))


def or_clock(time_s: FloatArray) -> str:
    """The other remedy for what changes too fast: the times, by how far samples are apart."""
    return f", or the times if the samples are not {np.median(np.diff(time_s)):.3g} s apart"


def _turning_rate(time: FloatArray, angle: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
    later = np.searchsorted(time, time + YAW_INTERVAL)
    first = np.flatnonzero(later < time.size)
    step = np.abs(angle[later[first]] - angle[first])
    # A wrapped angle jumps by a whole turn, which is no turning.
    step = np.minimum(step, np.abs(step - 2.0 * math.pi))
    return step / (time[later[first]] - time[first]), first


def check_rate(
    rate: FloatArray, unit: Unit, rows: list[int], place: Place, remedy: str = ""
) -> None:
    """Refuses angular rates in radians that can only be degrees.

    Args:
        rate: Measured or differenced rates, shape (n,), rad/s, NaN where missing.
        unit: The unit of the file; degrees are not questioned.
        rows: Line of the file of each rate.
        place: The file, run and column.
        remedy: What else may be corrected.

    Raises:
        DatasetError: A tenth of the run is faster than any fish turns.
    """
    size = np.abs(rate[np.isfinite(rate)])
    if unit.name not in ("rad", "rad/s") or not size.size:
        return
    fast = float(np.quantile(size, 0.9))
    if fast > FASTEST_TURNING:
        reason = f"a tenth of the run turns at {fast:.3g} rad/s or faster"
        first = int(np.argmax(np.abs(rate) > FASTEST_TURNING))
        raise _refuse_degrees(reason, unit, place.at(rows[first]), remedy)


def check_travel(
    time_s: FloatArray, channel: FloatArray, unit: Unit, rows: list[int], place: Place
) -> None:
    """Refuses a position that moves faster than anything swims, in metres or centimetres.

    Args:
        time_s: Sample times, shape (n,), s.
        channel: x, y, z or depth, shape (n,), m, NaN where missing.
        unit: The unit of the file; millimetres are not questioned.
        rows: Line of the file of each sample.
        place: The file, run and column.

    Raises:
        DatasetError: A tenth of the run is faster than that.
    """
    measured = np.flatnonzero(np.isfinite(channel))
    time, values = time_s[measured], channel[measured]
    later = np.searchsorted(time, time + TRAVEL_INTERVAL)
    first = np.flatnonzero(later < time.size)
    if unit.name == "mm" or not first.size:
        return
    speed = np.abs(values[later[first]] - values[first]) / (time[later[first]] - time[first])
    fast = float(np.quantile(speed, 0.9))
    if fast > FASTEST_TRAVEL:
        row = rows[measured[first[np.argmax(speed > FASTEST_TRAVEL)]]]
        raise place.at(row).refuse(
            f"a tenth of the run moves at {fast:.3g} m/s or faster, which no such fish does",
            f"Declare a smaller unit than '{unit.name}' for it in dataset.yaml, or correct the "
            f"cells{or_clock(time_s)}",
        )


def check_progress(
    beating_s: float, channels: Mapping[str, FloatArray], units: Mapping[str, Unit], place: Place
) -> None:
    """Refuses positions in small units that hardly change while the tail beats.

    Args:
        beating_s: How long the tail is asked to beat, s.
        channels: The measured positions, m, NaN where missing.
        units: Their units in the file; metres are not questioned.
        place: The file and run.

    Raises:
        DatasetError: All stay within what such a unit makes of a short way in metres.
    """
    if not channels or beating_s < LONG_ENOUGH or any(units[n].name == "m" for n in channels):
        return
    spans = {name: float(np.nanmax(a) - np.nanmin(a)) for name, a in channels.items()}
    if all(span < LITTLE_WAY * units[name].factor for name, span in spans.items()):
        names = sorted(spans, key=lambda n: -spans[n])
        ways = ", ".join(f"{name} {1e3 * spans[name]:.2g} mm" for name in names)
        declared = ", ".join(dict.fromkeys(f"'{units[name].name}'" for name in names))
        raise place.at(column=", ".join(names)).refuse(
            f"the fish hardly moves while the tail beats for {beating_s:.3g} s: {ways}",
            f"Declare the unit 'm' instead of {declared} where the cells are in metres, or "
            "leave out a run in which the fish is held",
        )


def _refuse_degrees(reason: str, unit: Unit, place: Place, remedy: str = "") -> Exception:
    degrees = unit.name.replace("rad", "deg")
    return place.refuse(
        f"{reason}: such radians can only be degrees",
        f"Declare the unit '{degrees}' for it in dataset.yaml, or correct the cells{remedy}",
    )
