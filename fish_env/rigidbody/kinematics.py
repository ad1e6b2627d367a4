"""Kinematic relations between measured channels, written as increments that should be zero.

Angles follow from angular rates, positions from velocities and attitude, whatever the forces are.
Between two samples of the one side, the other side is integrated along a cubic spline; what is left
over, and how it changes with biases, scales, delays and mountings, is what a relation returns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.interpolate import CubicSpline

from fish_env.arrays import BoolArray, FloatArray
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun

ANGLES, RATES = ("roll", "pitch", "yaw"), ("p", "q", "r")
POSITIONS, VELOCITIES = ("x", "y", "z"), ("u", "v", "w")
LONGEST_BRIDGE = 3.5
"""Usual sample intervals. Across a longer gap nothing is integrated."""
CHUNK, MEMORY = 60, 24
"""Samples that are integrated at a time, and how many beside them a spline takes into account."""
FEWEST_SAMPLES = 5
MARGIN_S = 0.2
"""s. Left out at both ends of a run."""


@dataclass(frozen=True)
class Setting:
    """Something a relation may be off by; zero when it is not.

    Attributes:
        name: what it is.
        unit: SI.
        words: what it says about the sensors.
        size: a small amount of it, for derivatives.
    """

    name: str
    unit: str
    words: str
    size: float


def _three(name: str, unit: str, words: str, size: float, axes: Sequence[str]) -> list[Setting]:
    return [Setting(f"{name}_{a}", unit, words.format(a), size) for a in axes]


@dataclass(frozen=True, eq=False)
class Increments:
    """What is left of one run's increments.

    Attributes:
        middle_s: (n,) time of each increment.
        span_s: (n,) its length.
        left: (n, rows) measured less integrated.
        joined: (n,) whether it begins with the sample that the one before ends with.
        gain: (n, rows, inputs) how each input's noise enters.
        input_step_s: usual interval of the inputs.
    """

    middle_s: FloatArray
    span_s: FloatArray
    left: FloatArray
    joined: BoolArray
    gain: FloatArray
    input_step_s: float


@dataclass(frozen=True, eq=False)
class Course:
    """Samples, and what lies between them: a cubic spline, held constant outside.

    Attributes:
        times: (n,).
        values: (n, columns).
    """

    times: FloatArray
    values: FloatArray

    def at(self, wanted: FloatArray) -> FloatArray:
        """Values at some times (m, columns)."""
        if np.array_equal(self.times, wanted):
            return self.values
        result: FloatArray = self._curve(np.clip(wanted, self.times[0], self.times[-1]))
        return result

    @cached_property
    def _curve(self) -> CubicSpline:
        return CubicSpline(self.times, self.values)


@dataclass(frozen=True, eq=False)
class Prepared:
    """One run, read for a relation.

    Attributes:
        t_out: (n,) times of the outputs.
        outputs: (n, rows).
        t_in: (m,) times of the inputs.
        inputs: (m, inputs).
        angles: the attitude (a, 1 or 3).
        keep: (n - 1,) increments that can be compared.
        integral: (n - 1, m) integrates what is sampled with the inputs between the outputs.
    """

    t_out: FloatArray
    outputs: FloatArray
    t_in: FloatArray
    inputs: FloatArray
    angles: Course
    keep: BoolArray
    integral: sparse.csr_array


@dataclass(frozen=True)
class Relation:
    """One relation, as far as the channels allow it.

    Attributes:
        name: "attitude" or "position".
        outputs: channels whose increments are looked at.
        inputs: channels that are integrated.
        level: roll and pitch are not measured and taken to be zero.
        settings: what it may be off by.
    """

    name: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    level: bool
    settings: tuple[Setting, ...]

    def prepared(self, run: RecordedRun) -> Prepared | None:
        """A run read for this relation; None without samples to compare."""
        attitude = ("yaw",) if self.level else ANGLES
        pairs = [_complete(run, names) for names in (self.outputs, self.inputs, attitude)]
        if min(len(times) for times, _ in pairs) < FEWEST_SAMPLES:
            return None
        (t_out, outputs), (t_in, inputs), (t_angle, angles) = pairs
        keep = _bridged(t_out, t_in) & _unjerked(run, t_out)
        if not keep.any():
            return None
        integral = integrator(t_in, t_out, run.switches_s)
        return Prepared(t_out, outputs, t_in, inputs, Course(t_angle, angles), keep, integral)

    def increments(self, run: Prepared, values: FloatArray) -> Increments:
        """What is left of the increments under settings.

        Args:
            run: as `prepared` reads it.
            values: one for each setting.
        """
        left, matrix = self._left(run, values)
        flat = matrix.reshape(len(run.t_in), -1)
        gain = Course(run.t_in, flat).at(run.t_out).reshape(-1, *matrix.shape[1:])
        middle, span = 0.5 * (run.t_out[1:] + run.t_out[:-1]), np.diff(run.t_out)
        joined = np.append(False, run.keep[:-1])[run.keep]
        step = float(np.median(np.diff(run.t_in)))
        keep = run.keep
        return Increments(middle[keep], span[keep], left, joined, gain[1:][keep], step)

    def left(self, run: Prepared, values: FloatArray) -> FloatArray:
        """What is left of the increments alone (n, outputs)."""
        return self._left(run, values)[0]

    def _left(self, run: Prepared, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is left, and the matrices that take the inputs to rates of the outputs."""
        given = dict(zip((s.name for s in self.settings), values, strict=True))
        bias = np.array([given.get(f"bias_{name}", 0.0) for name in self.inputs])
        names = ("yaw",) if self.level else ANGLES
        offset = np.array([given.get(f"{name}_offset", 0.0) for name in names])
        delay = given.get("delay", 0.0)
        # What is read at t was so at t - delay.
        euler = run.angles.at(run.t_in - delay) - offset
        matrix = self._matrix(euler, given)
        rates = np.einsum("nij,nj->ni", matrix, run.inputs - bias)
        grown = run.integral @ rates
        if delay:
            path = CubicSpline(run.t_in, rates).antiderivative()
            now, later = (np.clip(run.t_out + d, *run.t_in[[0, -1]]) for d in (0.0, delay))
            grown = grown + np.diff(path(later) - path(now), axis=0)
        grown = grown * (1.0 + given.get("scale", 0.0))
        if self.name == "position":
            arm = np.array([given.get(f"arm_{a}", 0.0) for a in "xyz"])[: len(self.outputs)]
            at = run.angles.at(run.t_out) - offset
            grown = grown + np.diff(np.einsum("nij,j->ni", self._matrix(at, given), arm), axis=0)
        return (np.diff(run.outputs, axis=0) - grown)[run.keep], matrix

    def _matrix(self, euler: FloatArray, given: dict[str, float]) -> FloatArray:
        """Inputs to rates of the outputs, (n, outputs, inputs)."""
        if self.level:
            if self.name == "attitude":
                return np.ones((len(euler), 1, 1))
            return rotations(np.column_stack([np.zeros((len(euler), 2)), euler]))[:, :2, :2]
        if self.name == "position":
            return rotations(euler)
        return euler_rates(euler) @ _turned(given.get("gyro_turn", 0.0))


def _complete(run: RecordedRun, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Times and values (n, names) where all these channels were measured; angles unwrapped."""
    values = np.column_stack([run.channels[name] for name in names])
    measured = np.isfinite(values).all(axis=1)
    values = values[measured]
    for column, name in enumerate(names):
        if name in ("roll", "yaw"):
            values[:, column] = np.unwrap(values[:, column])
    return run.time_s[measured], values


def _bridged(t_out: FloatArray, t_in: FloatArray) -> BoolArray:
    """Increments that lie within the inputs and across no gap of either side."""
    # At the ends a delay would ask for what was not measured.
    inside = (t_out[:-1] >= t_in[0] + MARGIN_S) & (t_out[1:] <= t_in[-1] - MARGIN_S)
    short = np.diff(t_out) <= LONGEST_BRIDGE * np.median(np.diff(t_out))
    wide = np.flatnonzero(np.diff(t_in) > LONGEST_BRIDGE * np.median(np.diff(t_in)))
    for gap in wide:
        inside &= (t_out[1:] <= t_in[gap]) | (t_out[:-1] >= t_in[gap + 1])
    whole: BoolArray = inside & short
    return whole


def _unjerked(run: RecordedRun, t_out: FloatArray) -> BoolArray:
    """Increments away from jerks, which make rates leap between samples.

    All of them if there are so many jerks that too few would be left.
    """
    step = float(np.median(np.diff(t_out)))
    keep = np.ones(len(t_out) - 1, bool)
    for at in run.jerks_s:
        keep &= (t_out[1:] < at - 0.5 * step) | (t_out[:-1] > at + 2.5 * step)
    return keep if keep.mean() > 1.0 - RECORDINGS.most_jerked else np.ones_like(keep)


def integrator(t_in: FloatArray, t_out: FloatArray, breaks: FloatArray) -> sparse.csr_array:
    """Matrix that integrates samples at `t_in` from each of `t_out` to the next.

    The samples are joined by cubic splines that may bend sharply at the breaks: where the servos
    are asked for something new, rates have a kink, and a smooth curve through it would cut a
    little off every swing.
    """
    return _integrator(t_in.tobytes(), t_out.tobytes(), breaks.tobytes())


@lru_cache(64)
def _integrator(inputs: bytes, outputs: bytes, kinks: bytes) -> sparse.csr_array:
    """The same for every question that is asked of a run, and for runs that are sampled alike."""
    t_in, t_out, breaks = (np.frombuffer(times) for times in (inputs, outputs, kinks))
    cuts = np.searchsorted(t_in, breaks - 0.5 * np.median(np.diff(t_in)))
    cuts = np.unique(np.clip(np.append(cuts, [0, len(t_in) - 1]), 0, len(t_in) - 1))
    parts = [
        _part(t_in, t_out, (first, last), begin, min(begin + CHUNK, last))
        for first, last in pairwise(cuts)
        for begin in range(first, last, CHUNK)
    ]
    weights, rows, columns = (np.concatenate(side) for side in zip(*parts, strict=True))
    return sparse.csr_array((weights, (rows, columns)), shape=(len(t_out) - 1, len(t_in)))


def _part(
    t_in: FloatArray, t_out: FloatArray, piece: tuple[int, int], begin: int, end: int
) -> tuple[FloatArray, npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """What the inputs from `begin` to `end` add to the integrals: weights, rows and columns.

    A spline forgets what is far away, so only so much of its smooth piece is looked at.
    """
    low, high = max(piece[0], begin - MEMORY), min(piece[1], end + MEMORY)
    curve = CubicSpline(t_in[low : high + 1], np.eye(high + 1 - low)).antiderivative()
    inside = np.flatnonzero((t_out[1:] > t_in[begin]) & (t_out[:-1] < t_in[end]))
    since, until = (np.clip(t, t_in[begin], t_in[end]) for t in (t_out[inside], t_out[inside + 1]))
    weights = curve(until) - curve(since)
    rows = np.repeat(inside, weights.shape[1])
    return weights.ravel(), rows, np.tile(np.arange(low, high + 1), len(inside))


def euler_rates(euler: FloatArray) -> FloatArray:
    """Body rates to rates of roll, pitch, yaw, (n, 3, 3)."""
    (sr, sp, _), (cr, cp, _) = np.sin(euler.T), np.cos(euler.T)
    tp, one, zero = sp / cp, np.ones_like(sr), np.zeros_like(sr)
    rows = [[one, sr * tp, cr * tp], [zero, cr, -sr], [zero, sr / cp, cr / cp]]
    return np.moveaxis(np.array(rows), 2, 0)


def rotations(euler: FloatArray) -> FloatArray:
    """Rotation matrices, body to inertial, of Z-Y-X Euler angles, (n, 3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(euler.T), np.cos(euler.T)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _turned(angle: float) -> FloatArray:
    """Turn about the vertical body axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _delay(late: str, early: str) -> Setting:
    return Setting("delay", "s", f"the {late} are older than the {early}", 1e-3)


def relations_of(channels: Sequence[str]) -> tuple[Relation, ...]:
    """The relations that channels allow.

    A fish that is filmed in the plane has no roll and pitch; it is then taken to swim level, and
    neither scale nor mounting can be told from a little roll or pitch.
    """
    found = []
    measured = set(channels)
    planar = not measured & {"z", "roll", "pitch", "w", "p", "q"}
    if measured >= {*ANGLES, *RATES}:
        found.append(_attitude())
    elif planar and measured >= {"yaw", "r"}:
        settings = (*_three("bias", "rad/s", "{} reads this at rest", 1e-3, "r"), _SCALE_OF_RATES)
        found.append(Relation("attitude", ("yaw",), ("r",), True, settings))
    if measured >= {*ANGLES, *POSITIONS, *VELOCITIES}:
        found.append(_position(POSITIONS, VELOCITIES, ANGLES, False))
    elif planar and measured >= {"x", "y", "yaw", "u", "v"}:
        found.append(_position(POSITIONS[:2], VELOCITIES[:2], ("yaw",), True))
    return tuple(found)


_SCALE_OF_RATES = Setting("scale", "-", "angles grow by this share more than the rates say", 1e-3)


def _attitude() -> Relation:
    settings = (
        *_three("bias", "rad/s", "{} reads this at rest", 1e-3, RATES),
        Setting("roll_offset", "rad", "roll reads this when level", 1e-3),
        Setting("pitch_offset", "rad", "pitch reads this when level", 1e-3),
        _SCALE_OF_RATES,
        _delay("rates", "angles"),
        Setting("gyro_turn", "rad", "the gyro is turned by this about its vertical axis", 1e-3),
    )
    return Relation("attitude", ANGLES, RATES, False, settings)


def _position(
    outputs: tuple[str, ...], inputs: tuple[str, ...], attitude: tuple[str, ...], level: bool
) -> Relation:
    settings = (
        *_three("bias", "m/s", "{} reads this at rest", 1e-4, inputs),
        *(Setting(f"{a}_offset", "rad", f"{a} is off by this", 1e-3) for a in attitude),
        Setting("scale", "-", "paths are this share longer than the speeds say", 1e-3),
        _delay("velocities", "positions"),
        *_three(
            "arm", "m", "the tracked point lies this far along {}", 1e-3, "xyz"[: len(outputs)]
        ),
    )
    return Relation("position", outputs, inputs, level, settings)


def turned(quaternion: FloatArray, angle: FloatArray) -> FloatArray:
    """Quaternions (4, N) body to inertial, turned about the downward axis by angles (N,) in rad."""
    w, x, y, z = quaternion
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    return np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
