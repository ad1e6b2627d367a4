"""The motion of a run as the filter predicts it, without the samples of the row."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from fish_env.arrays import FloatArray
from fish_env.identification.channels import BY_NAME
from fish_env.identification.filtering import Filtered, Slopes
from fish_env.identification.state_blocks import columns
from fish_env.model.frames import euler_from_quaternion
from fish_env.rigidbody.kinematics import euler_rates, rotations
from fish_env.sensing.geometry import ANGLES, RATES
from fish_env.sensing.low_pass import Foreseen, reshaped

_ROWS = {"velocity": [BY_NAME[n].index for n in "uvw"], "rate": [BY_NAME[n].index for n in "pqr"]}


@dataclass(frozen=True, eq=False)
class Motion:
    """A run as predicted, one sample ahead.

    Attributes:
        clock: (T,) times (s).
        place: (T, 3) (m).
        euler: (T, 3) angles.
        rates: (T, 3) of the body.
        slopes: rate of change (T, 3) of each of these.
        foreseen: (T, 3) angles and rates in the next row, without the samples of this one, and
            their rates of change there.
    """

    clock: FloatArray
    place: FloatArray
    euler: FloatArray
    rates: FloatArray
    slopes: tuple[FloatArray, FloatArray, FloatArray]
    foreseen: tuple[FloatArray, FloatArray, FloatArray, FloatArray]

    def ago(self, age: float) -> Motion:
        """The motion as it was some time (s) before each row.

        Between two rows it follows from both and its slopes there, and from nothing after: with
        that a regressor would follow its innovation.
        """
        if age == 0.0:
            return self
        at = np.maximum(self.clock - age, self.clock[0])
        seen = zip((self.place, self.euler, self.rates), self.slopes, strict=True)
        earlier = [np.asarray(CubicHermiteSpline(self.clock, *p)(at)) for p in seen]
        return replace(self, place=earlier[0], euler=earlier[1], rates=earlier[2])

    def filtered(self, channel: str, age: float, cutoff_hz: float) -> FloatArray:
        """What an inertial unit's filter does to samples (T,) of an angle or rate, likewise.

        Args:
            channel: the angle or rate.
            age: how much older than its row a sample is (s); late as the unit is, the filter of the
                motion takes that into account.
            cutoff_hz: of the unit's filter.
        """
        euler, rates, euler_slope, rate_slope = self.foreseen
        if channel in ANGLES:
            names, parts = ANGLES, (self.euler, self.slopes[1], euler, euler_slope)
        else:
            names, parts = RATES, (self.rates, self.slopes[2], rates, rate_slope)
        seen = Foreseen(self.clock, *(part[:, names.index(channel)] for part in parts))
        return reshaped(seen, age, cutoff_hz)


def predicted_motion(clock: FloatArray, filtered: Filtered) -> Motion:
    """The motion as predicted.

    A sample's own noise is in the filtered state, and would make its regressor follow its
    innovation. The prediction from the samples before is free of it.

    Raises:
        LinAlgError: the simulation has diverged.
    """
    slopes = slopes_of(filtered)
    moved = np.einsum("tec,tc->te", filtered.gains, np.nan_to_num(slopes.raw))
    states = filtered.states.copy()
    for name in ("velocity", "rate"):
        states[:, _ROWS[name]] -= moved[:, columns(name)]
    states[:, :3] -= moved[:, columns("position")]
    euler = np.unwrap(euler_from_quaternion(states[:, 3:7]), axis=0)
    kinematics = euler_rates(euler)
    euler -= np.einsum("tij,tj->ti", kinematics, moved[:, columns("rotation")])
    rates, velocity = states[:, _ROWS["rate"]], states[:, _ROWS["velocity"]]
    turning = np.einsum("tij,tj->ti", kinematics, rates)
    # What the samples of a row have changed goes on to the next one.
    on = np.einsum("tij,tj->ti", slopes.motion[1:], moved[:-1])
    turned = np.einsum("tij,tj->ti", kinematics[1:], on[:, columns("rotation")])
    euler_next = _with_last(euler[1:] - turned, euler, turning, clock)
    rates_next = rates[1:] - on[:, columns("rate")]
    slope, slope_next = _accelerations(clock, rates, filtered.states[:, _ROWS["rate"]], rates_next)
    rates_next = _with_last(rates_next, rates, slope, clock)
    turning_next = np.einsum("tij,tj->ti", euler_rates(euler_next), rates_next)
    change = (np.einsum("tij,tj->ti", rotations(euler), velocity), turning, slope)
    foreseen = (euler_next, rates_next, turning_next, slope_next)
    if not all(np.isfinite(one).all() for one in (states[:, :3], euler, rates, *change, *foreseen)):
        raise np.linalg.LinAlgError("the simulation diverges, and shows no sensor errors")
    return Motion(clock, states[:, :3], euler, rates, change, foreseen)


def _with_last(
    after: FloatArray, values: FloatArray, slope: FloatArray, clock: FloatArray
) -> FloatArray:
    """Values (T - 1, 3) in the next row with that of the last row, along its slope."""
    last = values[-1:] + slope[-1:] * (clock[-1] - clock[-2])
    return np.vstack([after, last])


def _accelerations(
    clock: FloatArray, predicted: FloatArray, filtered: FloatArray, foreseen: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Angular acceleration (T, 3) in each row, and foreseen in the next one.

    Both are slopes of the cubic through four rows, of which the last is foreseen. Its divided
    differences are those of three intervals, so that what samples change in a row does not count.

    Args:
        clock: (T,) times of the rows (s).
        predicted: (T, 3) rates before the samples of each row.
        filtered: (T, 3) rates after them.
        foreseen: (T - 1, 3) rates in the row after each, without its samples.
    """
    steps = np.maximum(np.diff(clock), 1e-9)[:, None]
    own, ahead = (predicted[1:] - filtered[:-1]) / steps, (foreseen - predicted[:-1]) / steps
    now = np.vstack([ahead[:1], own])
    before, after = np.vstack([now[:1], now[:-1]]), np.vstack([ahead, own[-1:]])
    step = np.vstack([steps[:1], steps])
    earlier, later = np.vstack([step[:1], step[:-1]]), np.vstack([steps, steps[-1:]])
    bend, bent = (after - now) / (later + step), (now - before) / (step + earlier)
    third = (bend - bent) / (later + step + earlier)
    here = after - later * bend - later * step * third
    return here, after + later * bend + later * (later + step) * third


def slopes_of(filtered: Filtered) -> Slopes:
    """The slopes of a filter.

    Raises:
        ValueError: it kept none.
    """
    if filtered.slopes is None:
        raise ValueError("filter the run with keep_slopes=True")
    return filtered.slopes
