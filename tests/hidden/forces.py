"""What an effect does to the accelerations along a motion: is it like anything simpler?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.hidden.jit import entry_point
from tests.hidden.motion import derivative
from tests.hidden.records import extra_record
from tests.hidden.servo import ROW, TIME
from tests.hidden.simulate import Swim


@entry_point
def accelerations(times, states, rows, fish, e, table, push, drive, out):
    """Fills `out` (T, 6) with the rates of velocity and angular velocity in given states."""
    matrix, wrench = np.empty((6, 6)), np.empty(6)
    slope = np.empty(states.shape[1])
    for i in range(len(times)):
        drive[ROW] = rows[i]
        derivative(times[i], states[i], slope, rows[i], rows[i], fish, e, table, push, drive,
                   matrix, wrench)  # fmt: skip
        out[i] = slope[12:18]


def rows_of(swim: Swim, times: np.ndarray) -> np.ndarray:
    """Row of the commands that holds at each time."""
    return np.maximum(np.searchsorted(swim.table[:, TIME], times, "right") - 1, 0)


def added_accelerations(
    swim: Swim, effects: Mapping[str, Mapping[str, float]], times: np.ndarray, states: np.ndarray
) -> np.ndarray:
    """What effects add to the accelerations in states they led to, (T, 6).

    Args:
        swim: the motion, already swum with these effects.
        effects: parameters by effect.
        times: (T,) s.
        states: (T, STATES).
    """
    both = []
    for acting in (effects, {}):
        out = np.empty((len(times), 6))
        accelerations(
            times, states, rows_of(swim, times), swim.fish, extra_record(acting), swim.table,
            swim.push.values, swim.drive.copy(), out,
        )  # fmt: skip
        both.append(out)
    return both[0] - both[1]
