"""Beat of each run's own tail, and how it sags, where runs differ in it.

A tail that beats half a per cent quicker than in the other runs is a radian off after thirty
seconds, and so is one whose battery loses a per cent in that time; then nothing fits. So every run
is filtered with a comb of frequencies at once, its starting phase being free within what servos
differ by. Where runs differ, it is filtered with a grid of frequencies and sags: the best frequency
without a sag may be that of half a run, from which no sag leads to the other half. Fits begin where
the grid leaves least, and estimate the rest of both as something the runs differ in. What the
runs share, beyond what the mean of so many ordinary runs may be, is a cause, to be found and named.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.by_run import squares_by_run
from fish_env.identification.in_step import nominal_point
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import PHASE, RunData
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tail_drive import LATE, RATE, SCALE, TailDrive, tail_drive
from fish_env.identification.variation import USUAL_BEAT, USUAL_SAG
from fish_env.inference.hypotheses import EffectParameterId

COARSE: FloatArray = np.asarray(1.0 + np.arange(-24, 25) * 5e-3)
"""Frequencies over the commanded one of all runs together, tried on their beginnings."""
BEGINNING_S = 8.0
COMB: FloatArray = np.asarray(np.arange(-25, 26) * 1e-3)
"""Differences from that: servos differ by one per cent or so from run to run."""
MEANS: FloatArray = np.asarray(np.arange(-12, 13) * 2e-3)
SAGS: FloatArray = np.asarray(np.arange(-4, 15) * 2.5e-4)
"""Grid of mean frequencies beside the common one, and of shares lost each second (1/s) beside what
was known of the drive. Half a step puts a tail of 1.5 Hz out of step by 0.2 rad after 30 s."""
FINE_MEANS: FloatArray = np.asarray(np.arange(-4, 5) * 5e-4)
FINE_SAGS: FloatArray = np.asarray(np.arange(-3, 4) * 1e-4)
"""The grid about the best of these."""
PHASE_SD = 0.2
"""How far the phase at the start of a run may be from the declared one (rad)."""
HALF_NORMAL = np.array([math.sqrt(2.0 / math.pi), math.sqrt(1.0 - 2.0 / math.pi)])
"""Mean and spread of what is normal and only counted where positive: batteries lose charge."""
LAGS = 5
"""Sizes of each effect that makes the tail late."""
AT_ONCE = 64
"""Teeth of a comb that are evaluated together: what each leaves of every sample takes memory."""


@dataclass(frozen=True)
class OwnBeats:
    """Tail frequencies that suit runs best.

    Attributes:
        drive: what all runs share of their beat; None where none is clear.
        own: frequency at the start over that of all runs, by run id; empty where runs share one.
        sags: share of the beat that is lost each second (1/s), by run id; empty likewise.
        gains: share of what the common beat leaves that its own takes away, by run id, of all runs
            whose own is another.
        left: logarithm of what the best beat of each run leaves, their mean.
    """

    drive: TailDrive | None = None
    own: Mapping[str, float] = field(default_factory=dict)
    sags: Mapping[str, float] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)
    left: float = math.inf


def own_beats(problem: SeriesProblem, differ: bool = False) -> OwnBeats:
    """Tail frequencies of runs by a comb of them, and how they sag where runs differ.

    A tail that is late hides how runs differ, or lets them differ by something else. Where they
    seem to differ, and a late tail explains much, they are looked at once more with that.

    Args:
        problem: all runs, those that are kept for judging too.
        differ: whether runs are known to differ in their beat.
    """
    found = _seen(problem, differ)
    if found.drive is None or not (found.own or found.gains):
        return found
    lag = _lag(problem.with_drive(replace(found.drive, uneven=False)))
    if not lag:
        return found
    late = tail_drive({**problem.drive.measured, **lag}, certain=True)
    again = _seen(problem.with_drive(late), differ)
    much = -math.log1p(-IDENTIFICATION.noticeable_own_beat)
    if again.drive is None or again.left > found.left - much:
        return found
    shared = {id: value for id, value in again.drive.measured.items() if id not in lag}
    drive = tail_drive(shared, problem.drive.certain, uneven=again.drive.uneven)
    return replace(again, drive=drive)


def _lag(problem: SeriesProblem) -> dict[EffectParameterId, float]:
    """The late tail that leaves least at the beat that all runs share; none if it takes little.

    None either if it would be later than is plausible.

    Args:
        problem: the runs, told that beat.
    """
    switches = [(name, p) for name in LATE for p in problem.known[name].switching]
    sizes = [
        (EffectParameterId(name, p.name), size)
        for name, p in switches
        for size in np.geomspace(*p.plausible, LAGS).tolist()
    ]
    latest = {
        (EffectParameterId(name, p.name), p.plausible[0 if math.isinf(p.neutral) else 1])
        for name, p in switches
    }
    neutral = problem.neutral(LATE)
    comb = {
        id: np.array([neutral[id], *(size if id == own else neutral[id] for own, size in sizes)])
        for id in dict.fromkeys(id for id, _ in sizes)
    }
    left = _left(problem.with_long_steps(), comb)
    if left is None:
        return {}
    total = left.sum(axis=1)
    best = int(np.argmin(total))
    if total[best] > (1.0 - IDENTIFICATION.noticeable_own_beat) * total[0]:
        return {}
    id, size = sizes[best - 1]
    is_last = any(id == other and math.isclose(size, end) for other, end in latest)
    return {} if is_last else {id: size}


def _seen(problem: SeriesProblem, differ: bool) -> OwnBeats:
    """As :func:`own_beats`, beside what is known of the drive alone."""
    # Long steps get the phase right, and all that is compared is in the same.
    free = problem.with_runs([_with_free_phase(run) for run in problem.runs]).with_long_steps()
    few = len(free.runs) < IDENTIFICATION.fewest_runs_for_beats
    if few or "frequency_scale" in free.model.effects:
        return OwnBeats()
    best = _comb(free)
    if best is None:
        return OwnBeats()
    comb, left = best
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
        found[run.id] = _minimum(mine, comb, own) / together
        if abs(found[run.id] - 1.0) >= IDENTIFICATION.least_beat_difference:
            gains[run.id] = 1.0 - float(mine[own] / mine[common])
    drive = problem.drive.at(together)
    least = float(np.log(left.min(axis=0)).mean())
    if not (differ or _differ(gains.values())):
        return OwnBeats(drive, gains=gains, left=least)
    if drive.effects and not drive.certain:
        # What runs differ by may look like a law of their beats, and a wrong law makes runs differ.
        return _seen(problem.with_drive(TailDrive()), differ)
    return replace(
        _sagging(free.with_drive(replace(drive, uneven=True)), found), gains=gains, left=least
    )


def _comb(problem: SeriesProblem) -> tuple[FloatArray, FloatArray] | None:
    """A comb of frequencies (n,), and what it leaves in whole runs (n, R); None if nothing can be.

    It is about the frequency that leaves least in the beginnings of runs. Where much is missing
    that may be a wrong one, so that another comb is tried about the commanded frequency.

    Args:
        problem: the runs, their starting phases being free.
    """
    coarse = _left(problem.until(BEGINNING_S), {SCALE: COARSE})
    if coarse is None:
        return None
    begun = float(COARSE[int(np.argmin(coarse.sum(axis=1)))])
    centres = {begun, 1.0} if abs(begun - 1.0) > 0.5 * COMB[-1] else {begun}
    combs = [centre + COMB for centre in sorted(centres)]
    tried = [(comb, _left(problem, {SCALE: comb})) for comb in combs]
    usable = [(comb, left) for comb, left in tried if left is not None]
    return min(usable, key=lambda pair: float(np.log(pair[1].min(axis=0)).sum()), default=None)


def _differ(gains: Iterable[float]) -> bool:
    """Whether runs differ, by the shares that their own beats take away.

    Beside a misfit the shares are smaller than where nothing else is wrong. In short runs, whose
    beat is hardly known, they are a hundredth.
    """
    known, shares = IDENTIFICATION, list(gains)
    noticeable = sum(share > known.noticeable_own_beat for share in shares)
    clear = max(shares, default=0.0) > known.clear_own_beat
    return noticeable >= known.fewest_own_beats or clear


def _sagging(problem: SeriesProblem, own: Mapping[str, float]) -> OwnBeats:
    """Own beats with their sags.

    Args:
        problem: the runs, told the beat that they share.
        own: mean frequency over that of all runs, by run id, where a grid shows none.
    """
    middle = 0.5 * float(np.median([run.duration for run in problem.runs]))
    means = np.array([own.get(run.id, 1.0) for run in problem.runs])
    sags = np.zeros(len(means))
    left = _left_on_grid(problem, MEANS, SAGS, middle)
    shared = 0.0
    if left is not None:
        shared = float(SAGS[int(np.argmin(left.min(axis=1).sum(axis=0)))])
        for i, mine in enumerate(left + _unusual(SAGS - shared)):
            mean, sag = np.unravel_index(int(np.argmin(mine)), mine.shape)
            if 0 < mean < len(MEANS) - 1 and 0 < sag < len(SAGS) - 1:
                means[i], sags[i] = 1.0 + MEANS[mean], SAGS[sag]
    ids = problem.run_ids
    begun = OwnBeats(
        problem.drive,
        dict(zip(ids, (means * (1.0 + middle * sags)).tolist(), strict=True)),
        dict(zip(ids, sags.tolist(), strict=True)),
    )
    left = _left_on_grid(with_own_beats(problem, begun), FINE_MEANS, FINE_SAGS, middle)
    for i, squares in enumerate(left if left is not None else ()):
        mine = squares + _unusual(sags[i] + FINE_SAGS - shared)
        mean, sag = np.unravel_index(int(np.argmin(mine)), mine.shape)
        means[i] += _between(mine[:, sag], FINE_MEANS, int(mean))
        sags[i] += _between(mine[mean], FINE_SAGS, int(sag))
    return _beside_shared(problem, means * (1.0 + middle * sags), sags, middle)


def _left_on_grid(
    problem: SeriesProblem, means: FloatArray, sags: FloatArray, middle: float
) -> FloatArray | None:
    """Squared innovations (R, means, sags) that each mean frequency and sag leave in each run.

    In units of the smallest mean square of each run: beside a misfit that is not one.

    Args:
        problem: the runs, told the beat that they share.
        means: frequencies in the middle of a run, less that beat, as a share of it.
        sags: shares lost each second (1/s).
        middle: half the length of a run (s).
    """
    mean, sag = (axis.ravel() for axis in np.meshgrid(means, sags, indexing="ij"))
    left = _left(problem, {RATE: sag, SCALE: problem.drive.scale * (1.0 + mean + middle * sag)})
    if left is None:
        return None
    samples = np.array([np.isfinite(run.measured).sum() for run in problem.runs])
    by_run = left.T / (left.min(axis=0) / samples)[:, None]
    return np.asarray(by_run.reshape(-1, len(means), len(sags)))


def _unusual(sags: FloatArray) -> FloatArray:
    """-2 log prior of sags beside what runs share (1/s): a short run hardly tells its own."""
    return np.asarray((sags / USUAL_SAG) ** 2)


def _beside_shared(
    problem: SeriesProblem, beats: FloatArray, sags: FloatArray, middle: float
) -> OwnBeats:
    """Own beats and sags beside what the runs share, which is nothing within what is ordinary.

    The beat in the middle of a run is surer than that at its start, which a sag trades with.

    Args:
        problem: the runs, told the beat that they share.
        beats: (R,) frequency at the start over that of the told drive.
        sags: (R,) share lost each second (1/s) beside that of the told drive.
        middle: half the length of a run (s).
    """
    beats = problem.drive.scale * beats
    sags = sags + problem.drive.measured.get(RATE, 0.0)
    ordinary = USUAL_SAG * HALF_NORMAL
    sure = IDENTIFICATION.ordinary_mean_sd / np.sqrt(len(beats))
    large = float(ordinary[0] + sure * ordinary[1])
    rate = float(sags.mean()) if sags.mean() > large else 0.0
    lost = middle * ordinary[0] if rate == 0.0 else 0.0
    off = float(np.mean(beats * (1.0 - middle * (sags - rate)))) - 1.0 + lost
    beyond = abs(off) > sure * np.hypot(USUAL_BEAT, middle * ordinary[1])
    scale = float(beats.mean()) if beyond else 1.0
    own, left = (beats / scale).tolist(), (sags - rate).tolist()
    ids = problem.run_ids
    drive = problem.drive.of_uneven_runs(scale, rate)
    return OwnBeats(drive, dict(zip(ids, own, strict=True)), dict(zip(ids, left, strict=True)))


def with_own_beats(problem: SeriesProblem, beats: OwnBeats) -> SeriesProblem:
    """The problem with the beat of each run's own tail, and its starting phase free.

    Args:
        problem: some of the runs.
        beats: what runs beat at. What they share is told to the problem and left to its effects.
    """
    drive = beats.drive or problem.drive
    if not beats.own:
        return problem.with_drive(drive)
    runs = [_beating(run, beats).without_smeared_gyros(problem.channels) for run in problem.runs]
    return problem.with_runs(runs).with_drive(replace(drive, uneven=True))


def _beating(run: RunData, beats: OwnBeats) -> RunData:
    beat, sag = beats.own.get(run.id, 1.0), beats.sags.get(run.id, 0.0)
    return replace(_with_free_phase(run), own_beat=beat, own_sag=sag)


def _with_free_phase(run: RunData) -> RunData:
    covariance = run.covariance0.copy()
    covariance[PHASE, PHASE] = max(covariance[PHASE, PHASE], PHASE_SD**2)
    return replace(run, covariance0=covariance)


def _left(
    problem: SeriesProblem, comb: Mapping[EffectParameterId, FloatArray]
) -> FloatArray | None:
    """Squared innovations (n, R) that each tooth of a comb leaves in each run; None if none can be.

    Args:
        problem: the runs.
        comb: effect parameter -> (n,); a rate counts beside what is known of the drive.
    """
    noise = replace(problem.default_noise(), phase_sd=0.0)
    begin = nominal_point(problem, comb)
    settled = problem.settled(begin, noise)
    try:
        filtered = settled.filtered(begin, noise)
    except np.linalg.LinAlgError:
        return None
    known = begin.effects.get(RATE, 0.0)
    at = {id: known + values if id == RATE else values for id, values in comb.items()}
    count = len(next(iter(comb.values())))
    squares = []
    for first in range(0, count, AT_ONCE):
        part = {id: values[first : first + AT_ONCE] for id, values in at.items()}
        size = min(AT_ONCE, count - first)
        z = np.repeat(begin.z[:, None], size, axis=1)
        held = {id: np.full(size, value) for id, value in begin.effects.items()}
        rows = settled.innovations(z, {**held, **part}, noise, filtered)
        squares.append(squares_by_run(rows, settled.runs))
    return np.vstack(squares)


def _between(left: FloatArray, comb: FloatArray, at: int) -> float:
    """The least of a comb between its teeth, or its end."""
    return _minimum(left, comb, at) if 0 < at < len(comb) - 1 else float(comb[at])


def _minimum(left: FloatArray, comb: FloatArray, at: int) -> float:
    """Frequency at which a parabola through three teeth of the comb is least."""
    before, here, after = left[at - 1 : at + 2]
    curve = before - 2.0 * here + after
    shift = 0.5 * (before - after) / curve if curve > 0.0 else 0.0
    return float(comb[at] + shift * (comb[1] - comb[0]))
