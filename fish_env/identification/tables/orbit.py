"""Steady swimming as a motion that repeats with every tail beat, found by Newton's method.

Under held commands the state after one beat is a function of the state before it, once the place
and the heading are set back to zero. Steady motion is a fixed point of that map. Newton's method
finds it within a few beats where waiting takes minutes of swimming, and a small change of the
fish moves it by one linear solution, so sensitivities cost one beat each (shooting for periodic
orbits: Nayfeh and Balachandran, Applied Nonlinear Dynamics, 1995, section 5.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.extended import ExtendedModel
from fish_env.identification.filtering import Measurement
from fish_env.identification.tables.means import MEANS, beat_means
from fish_env.model.frames import euler_from_quaternion, quaternion_from_euler
from fish_env.model.grid import Grid
from fish_env.model.state import BASE_STATES
from fish_env.steady import BEAT_WITHOUT_TAIL_S

FREQUENCY = tuple(COMMANDS).index("tail_frequency")
PHASE = BASE_STATES.index("tail_phase")
ATTITUDE, VELOCITY = slice(3, 7), slice(7, 13)
COORDINATES = 8
"""Roll, pitch, then velocity and angular velocity along the body's axes."""
NUDGES = np.r_[1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4]
"""Changes of the coordinates for finite differences, rad, m/s and rad/s."""
LONGEST_MOVE = np.r_[0.1, 0.1, 0.02, 0.02, 0.02, 0.2, 0.2, 0.2]
CLOSE = np.r_[1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4]
"""A fixed point is found when it is nearer than this: averages are then corrected along their
slopes, so what is left of the error is of second order."""
BEATS_FROM_REST = (40, 120)
"""Beats swum before Newton's method is tried: at first, and where it then fails."""
MOST_MOVES = 12
LATER_S = 20.0
CALM = 1.0 + 1e-6
"""Largest multiplier of a disturbance over one beat that counts as dying out."""


@dataclass(frozen=True, eq=False)
class Orbits:
    """Steady motion of n fish.

    Attributes:
        states: at the start of a beat, place and heading zero, shape (rows, n).
        slopes: derivative of coordinates after a beat, then of the averages over it, by
            coordinates before, shape (n, 15, 8).
        means: averages over a beat (see :func:`~fish_env.identification.tables.means.beat_means`),
            shape (7, n).
        found: whether the motion repeats and small disturbances of it die out, shape (n,).
    """

    states: FloatArray
    slopes: FloatArray
    means: FloatArray
    found: BoolArray

    def take(self, lanes: IntArray) -> Orbits:
        """Some of the fish, in the order asked for; a fish may be asked for more than once."""
        return Orbits(
            self.states[:, lanes], self.slopes[lanes], self.means[:, lanes], self.found[lanes]
        )

    def updated(self, lanes: IntArray, others: Orbits) -> Orbits:
        """The same with some of the fish replaced."""
        states, slopes = self.states.copy(), self.slopes.copy()
        means, found = self.means.copy(), self.found.copy()
        states[:, lanes], slopes[lanes] = others.states, others.slopes
        means[:, lanes], found[lanes] = others.means, others.found
        return Orbits(states, slopes, means, found)


def joined(orbits: Sequence[Orbits]) -> Orbits:
    """Steady motion of several groups of fish, one after another."""
    return Orbits(
        np.concatenate([o.states for o in orbits], axis=1),
        np.concatenate([o.slopes for o in orbits]),
        np.concatenate([o.means for o in orbits], axis=1),
        np.concatenate([o.found for o in orbits]),
    )


class Swimmer:
    """Swims whole beats of many fish at once.

    Args:
        model: gives kernel and coefficient tables.
        dt: longest physics step, s; the step used divides the beat.
    """

    def __init__(self, model: ExtendedModel, dt: float = 0.01) -> None:
        self.model, self.dt = model, dt

    def at_rest(self, commands: FloatArray, records: FloatArray) -> FloatArray:
        """States of fish that start level and at rest, shape (rows, n)."""
        state = np.zeros((len(self.model.kernels.state_names), len(commands)))
        state[BASE_STATES.index("qw")] = 1.0
        inputs = np.ascontiguousarray(commands.T)
        self.model.kernels.initialise(state, inputs, records, np.zeros(len(commands)))
        return state

    def beat(
        self,
        states: FloatArray,
        commands: FloatArray,
        records: FloatArray,
        measurement: Measurement,
        pace: FloatArray,
        beats: int = 1,
        elsewhere: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """States after some beats (rows, n), and averages (7, n) over the last.

        Args:
            states: shape (rows, n).
            commands: shape (n, 5).
            records: shape (parameters, n).
            measurement: what sensors and recorder do, n fish.
            pace: beats swum in the time of a commanded one, shape (n,).
            beats: how many.
            elsewhere: start each in another place, on another heading, later in the run.
        """
        after = np.empty_like(states)
        means = np.empty((len(MEANS), len(commands)))
        frequency = commands[:, FREQUENCY]
        period = 1.0 / (np.where(frequency > 0.0, frequency, 1.0 / BEAT_WITHOUT_TAIL_S) * pace)
        for one in np.unique(period):
            lanes = np.flatnonzero(period == one)
            trace = self._trace(
                states[:, lanes], commands[lanes], records[:, lanes], one, beats, elsewhere
            )
            after[:, lanes] = trace.final
            means[:, lanes] = beat_means(trace.samples, one, measurement, lanes)
        return after, means

    def _trace(
        self,
        states: FloatArray,
        commands: FloatArray,
        records: FloatArray,
        period: float,
        beats: int,
        elsewhere: bool,
    ) -> _Trace:
        count = len(commands)
        steps = int(np.ceil(period / self.dt - 1e-9))
        state = np.ascontiguousarray(states)
        record = np.ascontiguousarray(records)
        inputs = np.ascontiguousarray(commands.T)
        one = np.ones(1, np.int64)
        samples = np.empty((steps + 1, PHASE + 1, count))
        for _ in range(beats):
            state = displaced(settled(state)) if elsewhere else settled(state)
            samples[0] = state[: PHASE + 1]
            self.model.kernels.advance(
                state,
                inputs.copy(),
                record,
                np.full((len(COMMANDS), count), np.inf),
                np.full(count, LATER_S if elsewhere else 0.0),
                inputs[None].copy(),
                Grid(0 * one, np.zeros(1), steps * one, np.full(1, period / steps), one),
                tables=self.model.tables,
                failed_at=np.full(count, np.inf),
                trace=samples[1:],
            )
        return _Trace(state, samples)


@dataclass(frozen=True, eq=False)
class _Trace:
    final: FloatArray
    samples: FloatArray


def settled(states: FloatArray) -> FloatArray:
    """The same states with place and heading set back to zero."""
    moved = states.copy()
    moved[:3] = 0.0
    euler = euler_from_quaternion(states[ATTITUDE].T)
    euler[:, 2] = 0.0
    moved[ATTITUDE] = quaternion_from_euler(euler).T
    return moved


def displaced(states: FloatArray) -> FloatArray:
    """The same states in another place and on another heading."""
    moved = states.copy()
    moved[:3] += np.array([[1.0], [-0.7], [0.4]])
    euler = euler_from_quaternion(states[ATTITUDE].T)
    euler[:, 2] += 1.0
    moved[ATTITUDE] = quaternion_from_euler(euler).T
    return moved


def coordinates(states: FloatArray) -> FloatArray:
    """Coordinates of the map, shape (8, n)."""
    euler = euler_from_quaternion(states[ATTITUDE].T)
    return np.concatenate([euler[:, :2].T, states[VELOCITY]])


def with_coordinates(states: FloatArray, values: FloatArray) -> FloatArray:
    """States with other coordinates, place and heading zero."""
    moved = states.copy()
    moved[:3] = 0.0
    euler = np.zeros((values.shape[1], 3))
    euler[:, :2] = values[:2].T
    moved[ATTITUDE] = quaternion_from_euler(euler).T
    moved[VELOCITY] = values[2:]
    return moved


class OrbitFinder:
    """Newton's method on the map over one beat, for many fish at once."""

    def __init__(
        self,
        swimmer: Swimmer,
        commands: FloatArray,
        records: FloatArray,
        measurement: Measurement,
        pace: FloatArray,
    ) -> None:
        self.swimmer, self.commands, self.records = swimmer, commands, records
        self.measurement, self.pace = measurement, pace

    def beat(
        self,
        states: FloatArray,
        lanes: IntArray,
        beats: int = 1,
        elsewhere: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """One or more beats of some of the fish (see :meth:`Swimmer.beat`)."""
        part, records = self.measurement.take(lanes), self.records[:, lanes]
        return self.swimmer.beat(
            states, self.commands[lanes], records, part, self.pace[lanes], beats, elsewhere
        )

    def slopes(self, states: FloatArray, lanes: IntArray) -> FloatArray:
        """Derivative of coordinates after a beat and of its averages at states, (n, 15, 8)."""
        count = len(lanes)
        base = coordinates(states)
        probes = np.repeat(base[:, None], COORDINATES + 1, axis=1)
        probes[:, 1:] += np.diag(NUDGES)[:, :, None]
        wide = np.tile(states, (1, COORDINATES + 1))
        moved = with_coordinates(wide, probes.reshape(COORDINATES, -1))
        after, means = self.beat(moved, np.tile(lanes, COORDINATES + 1))
        seen = np.concatenate([coordinates(after), means]).reshape(-1, COORDINATES + 1, count)
        return np.moveaxis((seen[:, 1:] - seen[:, :1]) / NUDGES[None, :, None], 2, 0)

    def from_rest(self, lanes: IntArray, beats: int) -> FloatArray:
        """States of some of the fish a number of beats after the start."""
        states = self.swimmer.at_rest(self.commands[lanes], self.records[:, lanes])
        return self.beat(states, lanes, beats)[0]

    def find(self, near: Orbits | None = None, afresh: bool = False, alike: bool = False) -> Orbits:
        """Steady motion of all fish.

        It is followed from where it was: a change of the fish that loses it is too large, and a
        search from rest would find another motion, if any.

        Args:
            near: that of fish nearly alike, one for each; without it they start from rest.
            afresh: whether to work out derivatives anew where the motion near has given them.
            alike: whether fish are so much alike that where one has none, its like has none.
        """
        asked = np.arange(len(self.commands))
        if near is None:
            orbits = self._search(self.from_rest(asked, BEATS_FROM_REST[0]), asked, None)
        else:
            asked = np.flatnonzero(near.found) if alike else asked
            orbits = self._near(near, asked, afresh)
        lost = asked[~_steady(orbits)[asked]]
        if len(lost) and near is None:
            again = self._search(self.from_rest(lost, BEATS_FROM_REST[1]), lost, None)
            orbits = orbits.updated(lost, again)
        return replace(orbits, found=_steady(orbits))

    def _near(self, near: Orbits, lanes: IntArray, afresh: bool) -> Orbits:
        """Steady motion of some of the fish, looked for near that of like fish, and of no other."""
        carried = self._carried(near)
        orbits = Orbits(carried, near.slopes, near.means, np.zeros_like(near.found))
        if not len(lanes):
            return orbits
        found = self._search(carried[:, lanes], lanes, near.slopes[lanes])
        if afresh:
            found = replace(found, slopes=self.slopes(found.states, lanes))
        orbits = orbits.updated(lanes, found)
        lost = lanes[~_steady(orbits)[lanes]]
        if len(lost):
            orbits = orbits.updated(lost, self._search(carried[:, lost], lost, None))
        return orbits

    def _carried(self, near: Orbits) -> FloatArray:
        """States of other fish as a start: what effects add is set anew where kernels differ."""
        states = self.swimmer.at_rest(self.commands, self.records)
        rows = min(len(states), len(near.states))
        states[:rows] = near.states[:rows]
        return states

    def _search(self, states: FloatArray, lanes: IntArray, slopes: FloatArray | None) -> Orbits:
        """Newton's method, with derivatives of its own unless those of like fish are given."""
        count = len(lanes)
        states = settled(states)
        rows = COORDINATES + len(MEANS)
        own = np.zeros((count, rows, COORDINATES)) if slopes is None else slopes.copy()
        open_lanes = np.arange(count)
        found = np.zeros(count, bool)
        means = np.full((len(MEANS), count), np.nan)
        for _ in range(MOST_MOVES):
            part, asked = states[:, open_lanes], lanes[open_lanes]
            if slopes is None:
                own[open_lanes] = self.slopes(part, asked)
            after, swum = self.beat(part, asked)
            known, before = own[open_lanes], coordinates(part)
            move = _newton(known[:, :COORDINATES], coordinates(after) - before)
            means[:, open_lanes] = swum + np.einsum("nij,jn->in", known[:, COORDINATES:], move)
            close = np.all(np.abs(move) < CLOSE[:, None], axis=0) & _repeats(part, after)
            states[:, open_lanes] = with_coordinates(after, before + _limited(move))
            found[open_lanes[close]] = True
            open_lanes = open_lanes[~close]
            if not len(open_lanes):
                break
        return Orbits(states, own, means, found)


def _newton(slopes: FloatArray, missed: FloatArray) -> FloatArray:
    """How far the fixed point is from where a beat that misses by so much began."""
    system = np.eye(COORDINATES) - slopes
    bad = ~np.isfinite(system).all(axis=(1, 2)) | ~np.isfinite(missed).all(axis=0)
    system[bad], missed = np.eye(COORDINATES), np.where(bad, np.nan, missed)
    return np.asarray(np.linalg.solve(system, missed.T[:, :, None])[:, :, 0].T)


def _limited(move: FloatArray) -> FloatArray:
    """The same direction, no coordinate further than is sensible."""
    excess = np.max(np.abs(move) / LONGEST_MOVE[:, None], axis=0)
    return np.asarray(move / np.maximum(1.0, excess))


def _repeats(before: FloatArray, after: FloatArray) -> BoolArray:
    """Whether the states that effects add have settled, too."""
    rows = slice(len(BASE_STATES), None)
    return np.asarray(np.all(np.abs(after[rows] - before[rows]) < 1e-4, axis=0))


def _steady(orbits: Orbits) -> BoolArray:
    """Whether the motion of each fish repeats, and small disturbances of it die out."""
    return np.asarray(orbits.found & dies_out(orbits.slopes))


def dies_out(slopes: FloatArray) -> BoolArray:
    """Whether small disturbances die out, by the derivative of the map, shape (n,)."""
    whole = np.asarray(np.isfinite(slopes).all(axis=(1, 2)))
    safe = np.where(whole[:, None, None], slopes[:, :COORDINATES], 0.0)
    return np.asarray(whole & (np.abs(np.linalg.eigvals(safe)).max(axis=1) < CALM))
