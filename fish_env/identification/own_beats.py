"""Beat of each run's own tail, where runs differ in it.

A tail that beats half a per cent quicker than in the other runs is a radian off after thirty
seconds, and then nothing fits. So every run is filtered with a comb of frequencies at once, its
starting phase being free within what servos differ by. The frequency that leaves least is taken for
a run's own where it leaves clearly less than the one which suits all runs together. What the runs
share is a cause, to be found and named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.runs import FREQUENCY, PHASE, RunData
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tail_drive import SCALE
from fish_env.inference.hypotheses import effects_of
from fish_env.inference.problem import Point

COARSE: FloatArray = np.asarray(1.0 + np.arange(-24, 25) * 5e-3)
"""Frequencies over the commanded one of all runs together, tried on their beginnings."""
BEGINNING_S = 8.0
COMB: FloatArray = np.asarray(np.arange(-25, 26) * 1e-3)
"""Differences from that: servos differ by one per cent or so from run to run."""
PHASE_SD = 0.2
"""How far the phase at the start of a run may be from the declared one (rad)."""
USUAL_BEAT = 4e-3
"""Ordinary spread of servos' frequencies over runs."""
LEAST = 1.5e-3
"""Difference of two beats below which the comb cannot tell them apart."""
CLEARLY = 0.2
"""Share of what the common beat leaves that a run's own has to take away. Of 24 sets of runs with
one beat two had such a run, where beats differ as servos do four of four
(`scripts/calibrate_own_beats.py`). A lower one for the other runs of such a set made fits no
better: the random walk of the phase follows what they differ by."""
FEWEST = 3


@dataclass(frozen=True)
class OwnBeats:
    """Tail frequencies that suit runs best.

    Attributes:
        common: frequency over the commanded one, of all runs together, beside what was known of
            the drive; None where none is clear.
        own: frequency over that of all runs, by run id; runs that do not differ are left out.
        gains: share of what the common beat leaves that its own takes away, by run id, of all runs
            whose own is another.
    """

    common: float | None = None
    own: Mapping[str, float] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)


def own_beats(problem: SeriesProblem) -> OwnBeats:
    """Tail frequencies of runs by a comb of them.

    Args:
        problem: all runs, those that are kept for judging too.
    """
    free = problem.with_runs([_with_free_phase(run) for run in problem.runs])
    if len(free.runs) < FEWEST or "frequency_scale" in free.model.effects:
        return OwnBeats()
    coarse = _left(free.until(BEGINNING_S), COARSE)
    if coarse is None:
        return OwnBeats()
    comb = COARSE[int(np.argmin(coarse.sum(axis=1)))] + COMB
    left = _left(free, comb)
    if left is None:
        return OwnBeats()
    total = left.sum(axis=1)
    common = int(np.argmin(total))
    if not 0 < common < len(comb) - 1:
        return OwnBeats()
    together = _minimum(total, comb, common)
    found, gains = {}, {}
    for run, mine in zip(free.runs, left.T, strict=True):
        own = int(np.argmin(mine))
        if not 0 < own < len(comb) - 1:
            continue
        beat = _minimum(mine, comb, own) / together
        if abs(beat - 1.0) >= LEAST:
            found[run.id], gains[run.id] = beat, 1.0 - float(mine[own] / mine[common])
    clear = {run: beat for run, beat in found.items() if gains[run] > CLEARLY}
    return OwnBeats(together, clear, gains)


def with_own_beats(problem: SeriesProblem, beats: OwnBeats) -> SeriesProblem:
    """The problem with commands as each run's own tail follows them, and its starting phase free.

    Args:
        problem: some of the runs.
        beats: what runs beat at. What they share is told to the problem and left to its effects.
    """
    drive = problem.drive if beats.common is None else problem.drive.at(beats.common)
    if not beats.own:
        return problem.with_drive(drive)
    runs = [_beating(run, beats.own.get(run.id, 1.0)) for run in problem.runs]
    return problem.with_runs(runs).with_drive(replace(drive, uneven=True))


def _beating(run: RunData, beat: float) -> RunData:
    values = run.command_values.copy()
    values[:, FREQUENCY] *= beat
    return replace(_with_free_phase(run), command_values=values, own_beat=beat)


def _with_free_phase(run: RunData) -> RunData:
    covariance = run.covariance0.copy()
    covariance[PHASE, PHASE] = max(covariance[PHASE, PHASE], PHASE_SD**2)
    return replace(run, covariance0=covariance)


def _left(problem: SeriesProblem, comb: FloatArray) -> FloatArray | None:
    """Squared innovations (n, R) that each frequency leaves in each run; None if none can be."""
    noise = problem.default_noise()
    own = {path: value for path, value in problem.drive.measured.items() if path != SCALE}
    begin = Point(problem.start.z, {**problem.neutral(effects_of(own)), **own})
    settled = problem.settled(begin, noise)
    try:
        filtered = settled.filtered(begin, noise)
    except np.linalg.LinAlgError:
        return None
    z = np.repeat(begin.z[:, None], len(comb), axis=1)
    held = {path: np.full(len(comb), value) for path, value in begin.effects.items()}
    rows = settled.innovations(z, {**held, SCALE: comb}, noise, filtered)
    ends = np.cumsum([run.measured.size for run in settled.runs])[:-1]
    parts = [np.sum(own * own, axis=1) for own in np.split(rows, ends, axis=1)]
    found = np.column_stack(parts)
    return np.where(np.isfinite(found), found, np.inf)


def _minimum(left: FloatArray, comb: FloatArray, at: int) -> float:
    """Frequency at which a parabola through three teeth of the comb is least."""
    before, here, after = left[at - 1 : at + 2]
    curve = before - 2.0 * here + after
    shift = 0.5 * (before - after) / curve if curve > 0.0 else 0.0
    return float(comb[at] + shift * (comb[1] - comb[0]))
