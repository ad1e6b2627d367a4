"""One run of the hidden physics: commands and pushes in, states at any times out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tests.hidden.integrate import advance, begin
from tests.hidden.motion import STATES
from tests.hidden.records import extra_record, fish_record
from tests.hidden.servo import AMPLITUDE, DRIVE_SIZE, FREQUENCY, OFFSET, PHASE, TIME

LONGEST_STEP = 0.002
"""s. Fifth order: the error over a run is below a micrometre, far below any sensor."""

DECIDED = {"servo_rate_limit", "servo_backlash", "servo_torque_limit", "angle_limit"}
"""Effects that decide once a step whether the tail is held."""


@dataclass(frozen=True)
class Push:
    """A random push sampled evenly: force (N) and moment (N m), shape (n, 6)."""

    start: float = 0.0
    step: float = 1e6
    values: np.ndarray = field(default_factory=lambda: np.zeros((2, 6)))
    inertial: bool = False


@dataclass(frozen=True)
class Start:
    """Pose and velocities at the first time; SI, radians."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    euler: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phase: float = 0.0


def rotation(euler) -> np.ndarray:
    """Body to inertial from roll, pitch, yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler), np.sin(euler)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return yaw @ pitch @ roll


class Swim:
    """A fish that swims on in pieces: `run` may be called again with later commands.

    Args:
        fish: number by path.
        effects: parameters by effect, of the catalogue or foreign.
        start: state at the first command's time.
        push: the disturbance.
        longest: longest step, s.
    """

    def __init__(
        self,
        fish: Mapping[str, float],
        effects: Mapping[str, Mapping[str, float]] | None = None,
        start: Start | None = None,
        push: Push | None = None,
        longest: float = LONGEST_STEP,
    ) -> None:
        self.effects = dict(effects or {})
        self.fish, self.extra = fish_record(fish), extra_record(self.effects)
        self.push = push or Push()
        self.extra["push_start"], self.extra["push_step"] = self.push.start, self.push.step
        self.extra["push_inertial"] = float(self.push.inertial)
        # Limits and plays decide once a step what they do, so their steps are shorter.
        decides = self.effects.keys() & DECIDED
        self.longest = 0.25 * longest if decides else longest
        if "servo_torque_limit" in self.effects:  # a tenth of the rotor's time constant
            self.longest *= 0.5
        start = start or Start()
        self.phase = start.phase
        self.state = np.zeros(STATES)
        self.state[0:3] = start.position
        self.state[3:12] = rotation(start.euler).ravel()
        self.state[12:15], self.state[15:18] = start.velocity, start.spin
        self.drive = np.zeros(DRIVE_SIZE)
        self.table = np.zeros((0, 7))
        self.time = np.nan

    def command(self, rows: np.ndarray) -> None:
        """Appends rows of time and five commands, shape (n, 6)."""
        first = not len(self.table)
        self.table = np.concatenate([self.table, np.column_stack([rows, np.zeros(len(rows))])])
        self.table[:, PHASE] = self._phases()
        if first:
            self.time = float(self.table[0, TIME])
            begin(self.state, self.fish, self.extra, self.table, self.drive)

    def phase_at(self, time: float) -> float:
        """Phase of the commanded tail, rad."""
        row = self.table[max(int(np.searchsorted(self.table[:, TIME], time, "right")) - 1, 0)]
        sag, begin = float(self.extra["battery_sag_rate"]), row[TIME]
        speed = float(self.extra["frequency_scale_scale"]) * row[FREQUENCY]
        speed *= float(self._slowed(row[None])[0])
        run = (time - begin) - 0.5 * sag * (time**2 - begin**2)
        return float(row[PHASE] + 2.0 * np.pi * speed * run)

    def run(self, until: float, sample_times: np.ndarray) -> np.ndarray:
        """States at the sample times, (T, STATES), all within the present time and `until`."""
        switches = self.table[:, TIME]
        delay = float(self.extra["servo_delay_delay"])
        strokes = self._strokes(until) + delay
        events = np.concatenate([switches, switches + delay, strokes, sample_times, [until]])
        inside = events[(events > self.time) & (events <= until)]
        edges = np.union1d(self.time, inside)
        edges = edges[np.concatenate([[True], np.diff(edges) > 1e-9])]
        middle = 0.5 * (edges[1:] + edges[:-1])
        rows = np.maximum(np.searchsorted(switches, middle, "right") - 1, 0)
        lates = np.searchsorted(switches, middle - delay, "right") - 1
        store = np.full(len(edges), -1)
        store[np.searchsorted(edges, sample_times - 1e-9)] = np.arange(len(sample_times))
        out = np.empty((len(sample_times), STATES))
        advance(
            self.state, edges, rows, lates, store, out, self.fish, self.extra, self.table,
            self.push.values, self.drive, self.longest,
        )  # fmt: skip
        self.time = until
        return out

    def _strokes(self, until: float) -> np.ndarray:
        """Times at which the commanded tail passes its middle, where that bends its motion, s."""
        if self.extra["tail_asymmetry_ratio"] == 0.0:
            return np.zeros(0)
        ends = np.append(self.table[1:, TIME], until)
        pieces = [self._strokes_of(row, end) for row, end in zip(self.table, ends, strict=True)]
        return np.concatenate(pieces)

    def _strokes_of(self, row: np.ndarray, end: float) -> np.ndarray:
        speed = 2.0 * np.pi * float(self.extra["frequency_scale_scale"]) * row[FREQUENCY]
        sag, begin = float(self.extra["battery_sag_rate"]), row[TIME]
        if speed <= 0.0 or end <= begin:
            return np.zeros(0)
        last = row[PHASE] + speed * (end - begin)
        turns = np.arange(row[PHASE] // np.pi, last // np.pi + 1) * np.pi
        t = np.full(len(turns), begin)
        for _ in range(6):  # Newton: the phase bends a little where the battery sags
            run = (t - begin) - 0.5 * sag * (t**2 - begin**2)
            t = t + ((turns - row[PHASE]) / speed - run) / (1.0 - sag * t)
        return t[(t > begin) & (t < end)]

    def _phases(self) -> np.ndarray:
        """Tail phase at each row: the integral of the frequency, which may be scaled and sag."""
        scale = float(self.extra["frequency_scale_scale"])
        sag = float(self.extra["battery_sag_rate"])
        t = self.table[:, TIME]
        run = np.diff(t) - 0.5 * sag * np.diff(t**2)
        beats = scale * self.table[:-1, FREQUENCY] * self._slowed(self.table[:-1]) * run
        return self.phase + 2.0 * np.pi * np.concatenate([[0.0], np.cumsum(beats)])

    def _slowed(self, rows: np.ndarray) -> np.ndarray:
        """Share of the commanded frequency that is left in rows of the commands."""
        stroke = 2.0 * np.pi * rows[:, AMPLITUDE] * rows[:, FREQUENCY]
        by_offset = 1.0 - float(self.extra["beat_load_offset"]) * np.abs(rows[:, OFFSET])
        aside = 1.0 - float(self.extra["side_load_beat"]) * np.tanh(10.0 * np.abs(rows[:, OFFSET]))
        return by_offset * aside * (1.0 - float(self.extra["beat_load_load"]) * stroke)


def simulate(
    fish: Mapping[str, float],
    commands: np.ndarray,
    sample_times: np.ndarray,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    start: Start | None = None,
    push: Push | None = None,
    longest: float = LONGEST_STEP,
) -> np.ndarray:
    """States of a whole run at its sample times, (T, STATES).

    Args:
        fish: number by path.
        commands: (n, 6) time and five commands; the first time is the run's start.
        sample_times: (T,) s, increasing, none before the start.
        effects: parameters by effect.
        start: state at the start.
        push: the disturbance.
        longest: longest step, s.
    """
    swim = Swim(fish, effects, start, push, longest)
    swim.command(np.asarray(commands, float))
    return swim.run(float(sample_times[-1]), np.asarray(sample_times, float))
