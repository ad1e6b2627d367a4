"""Order tracking: at which multiple of the commanded frequency the hull sways.

Commands may change all the time, so the hull's sway is not looked for at a frequency but along the
commanded phase: a tail that beats at a multiple of what it was told sways the hull with that
multiple of the phase. Windows are fitted each with a phase of its own, so neither the tail's phase
nor how fast the hull answers matters.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.data.schema import CommandSteps
from fish_env.data.vocabulary import COMMANDS
from fish_env.effects.side_load import ONSET
from fish_env.rigidbody.gridded import GridRun

SWAYING = ("r", "yaw", "v", "y")
"""Channels in which a beat shows, the clearest first."""
CYCLES = 6.0
"""Cycles of the sway that a window holds, on average."""
SLOW_PER_CYCLE = 0.8
"""Degrees of the polynomial, for each cycle, that takes what is slower off."""
LOWEST, HIGHEST = 0.15, 6.6
"""Multiples of the commanded frequency that are looked at: 0.2 to 5, and radians for turns."""
FINENESS = 0.12
"""Step of the multiples, in cycles at the end of a window."""
NYQUIST = 0.45
"""Cycles a sample up to which a sway can be seen."""
OFFSET, AMPLITUDE, FREQUENCY = (
    list(COMMANDS).index(f"tail_{n}") for n in ("offset", "amplitude", "frequency")
)


def stroke_speed(commands: FloatArray) -> FloatArray:
    """Speed of commanded strokes, 2 pi times amplitude times frequency, (n,), rad/s.

    Args:
        commands: (n, 5) in the order of :data:`COMMANDS`.
    """
    speed: FloatArray = 2.0 * np.pi * commands[:, AMPLITUDE] * commands[:, FREQUENCY]
    return speed


def drive_terms(since_s: FloatArray, commands: FloatArray) -> FloatArray:
    """What may slow a drive, (n, 4), a column each.

    Time since the start of the run (s), offset without its sign (rad), speed of the stroke (rad/s),
    and the share of its full size that friction has under a load on one side.

    Args:
        since_s: (n,) time since the start of the run.
        commands: (n, 5) in the order of :data:`COMMANDS`.
    """
    aside = np.abs(commands[:, OFFSET])
    return np.column_stack([since_s, aside, stroke_speed(commands), np.tanh(aside / ONSET)])


@dataclass(frozen=True, eq=False)
class Stroke:
    """The commanded stroke of a run on its grid, and what it makes the hull do.

    Attributes:
        phase: (n,) commanded phase, rad.
        amplitude: (n,) commanded amplitude, rad.
        sway: (n,) channel in which the beat shows, NaN in gaps.
        step_s: s.
        terms: (n, 4) what may slow a drive, see :func:`drive_terms`.
    """

    phase: FloatArray
    amplitude: FloatArray
    sway: FloatArray
    step_s: float
    terms: FloatArray


def stroke_of(run: GridRun, steps: CommandSteps) -> Stroke | None:
    """The stroke of a run; None if no channel shows it."""
    channel = next((name for name in SWAYING if name in run.channels), None)
    if channel is None:
        return None
    times = run.begin_s + run.since_s
    edges = np.append(steps.times_s, np.inf)
    frequency = steps.values[:, FREQUENCY]
    turned = np.concatenate([[0.0], np.cumsum(np.diff(steps.times_s) * frequency[:-1])])
    row = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(frequency) - 1)
    cycles = turned[row] + np.maximum(times - steps.times_s[row], 0.0) * frequency[row]
    amplitude = steps.values[row, AMPLITUDE]
    terms = drive_terms(run.since_s, steps.values[row])
    return Stroke(2.0 * np.pi * cycles, amplitude, run.channels[channel], run.step_s, terms)


def strokes_under(runs: Iterable[GridRun], steps: Iterable[CommandSteps]) -> dict[str, Stroke]:
    """Strokes under the commands of each run, by its id, of runs with a channel that shows them."""
    every = {run.id: stroke_of(run, own) for run, own in zip(runs, steps, strict=True)}
    return {run: stroke for run, stroke in every.items() if stroke is not None}


@dataclass(frozen=True, eq=False)
class Windows:
    """Stretches of a run whose samples lie alike, what is slow in them taken off.

    Attributes:
        phase: (w, n) commanded phase about its middle, rad.
        amplitude: (w, n) commanded amplitude over its mean.
        slow: (n, k) orthonormal basis of what is slow.
        sway: (w, n) residual of the channel.
        rate: (w,) commanded frequency at its quickest, cycles a sample.
        terms: (w, 4) mean of the stroke's.
    """

    phase: FloatArray
    amplitude: FloatArray
    slow: FloatArray
    sway: FloatArray
    rate: FloatArray
    terms: FloatArray


def windows_of(strokes: Iterable[Stroke], multiple: float) -> list[Windows]:
    """Windows of runs that suit sways at about a multiple of the commanded frequency."""
    return [own for stroke in strokes for own in _windows_of(stroke, multiple)]


def _windows_of(stroke: Stroke, multiple: float) -> list[Windows]:
    beating = stroke.amplitude > 0.0
    if beating.sum() < 10:
        return []
    mean = float(stroke.phase[-1] - stroke.phase[0]) / (2.0 * np.pi * beating.sum())
    length = int(min(np.ceil(CYCLES / max(mean * multiple, 1e-6)), len(stroke.sway)))
    usable = np.isfinite(stroke.sway) & beating
    alike: dict[bytes, list[IntArray]] = {}
    for first in range(0, len(stroke.sway) - length + 1, length):
        used = np.flatnonzero(usable[first : first + length])
        if len(used) < max(12, 0.7 * length):
            continue
        alike.setdefault((used - used[0]).tobytes(), []).append(first + used)
    return [_windows(stroke, places, np.array(at)) for places, at in alike.items()]


def _windows(stroke: Stroke, places: bytes, at: IntArray) -> Windows:
    """Windows at samples (w, n) of a run, which lie at the same places in each."""
    slow = _slow(places)
    phase, amplitude, sway = stroke.phase[at], stroke.amplitude[at], stroke.sway[at]
    return Windows(
        phase - phase.mean(axis=1, keepdims=True),
        amplitude / amplitude.mean(axis=1, keepdims=True),
        slow,
        sway - (sway @ slow) @ slow.T,
        np.max(np.diff(phase) / np.diff(at), axis=1) / (2.0 * np.pi),
        stroke.terms[at].mean(axis=1),
    )


@lru_cache(256)
def _slow(places: bytes) -> FloatArray:
    """Orthonormal polynomials at places (n,) of a window, (n, k); most windows share theirs."""
    at = np.frombuffer(places, np.int64)
    degree = int(SLOW_PER_CYCLE * CYCLES)
    vander = np.polynomial.legendre.legvander(2.0 * at / at[-1] - 1.0, degree)
    basis: FloatArray = np.linalg.qr(vander)[0]
    return basis


def explained(windows: Iterable[Windows], multiples: FloatArray) -> FloatArray:
    """Share of the sway at each multiple of the commanded frequency, (N, m), a row each window."""
    none = np.zeros((0, len(multiples)))
    return np.concatenate([none, *(_explained(own, multiples) for own in windows)])


def _explained(own: Windows, multiples: FloatArray) -> FloatArray:
    angle = multiples[:, None] * own.phase[:, None]
    pair = [own.amplitude[:, None] * f(angle) for f in (np.cos, np.sin)]
    c, s = (a - (a @ own.slow) @ own.slow.T for a in pair)
    cc, ss, cs = (np.einsum("wmn,wmn->wm", *ab) for ab in ((c, c), (s, s), (c, s)))
    c1, s1 = (np.einsum("wmn,wn->wm", a, own.sway) for a in (c, s))
    determinant = np.maximum(cc * ss - cs**2, 1e-12 * (cc * ss + 1e-300))
    gain = (ss * c1**2 - 2.0 * cs * c1 * s1 + cc * s1**2) / determinant
    whole = np.einsum("wn,wn->w", own.sway, own.sway)
    share = gain / np.maximum(whole, 1e-300)[:, None]
    seen = multiples * own.rate[:, None] < NYQUIST
    result: FloatArray = np.where(seen, np.clip(share, 0.0, 1.0), 0.0)
    return result


def bands() -> list[FloatArray]:
    """Multiples to try, in bands that share a length of window."""
    edges = np.geomspace(LOWEST, HIGHEST, 8)
    return [np.arange(low, high, FINENESS * low / CYCLES) for low, high in pairwise(edges.tolist())]
