"""Clocks and beats that are off by little: what the beat says, held against the kinematics.

A beat that is a per cent too quick is a tail that beats so, or a clock that runs slow. Only the
second makes angles grow faster than their rates say, and by the same per cent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, ndtr

from fish_env.data.schema import Dataset
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clock_changes import beat, clock, skew
from fish_env.diagnosis.inputs.clocks import strokes_of
from fish_env.diagnosis.inputs.orders import Stroke
from fish_env.diagnosis.inputs.ratios import Ratio, ratio_near
from fish_env.diagnosis.inputs.skews import Aligner, near_skew, offset_near
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.beats import beats_of, by_run
from fish_env.identification.recorded import recorded
from fish_env.inference.policy import POLICY
from fish_env.rigidbody.consistency import check_consistency
from fish_env.rigidbody.kinematic_fit import Estimate


@dataclass(frozen=True, eq=False)
class Fine:
    """A clock or beat that is off by little.

    Attributes:
        change: what puts it right.
        interval: of its value, 95 %.
        p: probability by chance.
        rivals: other changes that explain as much.
        sure: whether it is known which of clock and beat is off.
    """

    change: Change
    interval: tuple[float, float]
    p: float
    rivals: tuple[Change, ...]
    sure: bool


def fine_clock(dataset: Dataset, rng: np.random.Generator, beside_law: bool = False) -> Fine | None:
    """A clock, or a beat, that is off by little; None if neither is.

    Args:
        dataset: with what is grossly wrong put right, and commands as a law of the beat has them.
        rng: for the resampling of the kinematic test.
        beside_law: whether a law says what the runs share: only their differences are looked for.
    """
    strokes = strokes_of(dataset)
    known = _ratios(strokes)
    p = _uneven(list(known.values()))
    if p is not None:
        ratios = _of_every_run(dataset, known)
        if beside_law:
            middle = float(np.median(list(ratios.values())))
            ratios = {run: ratio / middle for run, ratio in ratios.items()}
        change = beat(ratios)
        if beside_law:
            change = replace(change, words=f"beside that, {change.words}")
        late = _late_commands(dataset, change)
        if late is not None:
            return late
        return Fine(change, (min(ratios.values()), max(ratios.values())), p, (), True)
    whole = None if beside_law else ratio_near(list(strokes.values()))
    if whole is None or not _off(whole):
        return None
    return _clock_or_beat(dataset, whole, rng)


def _ratios(strokes: Mapping[str, Stroke]) -> dict[str, Ratio]:
    """The ratio of each run that shows its beat."""
    single = {run: ratio_near([stroke]) for run, stroke in strokes.items()}
    return {run: ratio for run, ratio in single.items() if ratio is not None}


def _late_commands(dataset: Dataset, uneven: Change) -> Fine | None:
    """Commands at other times than they are logged, if beats are even then; None if they are not.

    Each change of the commanded frequency then shifts the phase, which looks like another beat.
    """
    aligner = Aligner.of(dataset)
    near = None if aligner is None else near_skew(aligner)
    if aligner is None or near is None:
        return None
    shift, interval, p = offset_near(aligner, near[1])
    if _uneven(list(_ratios(aligner.strokes((1.0, shift))).values())) is not None:
        return None
    return Fine(skew(1.0, shift), interval, p, (uneven,), False)


def _of_every_run(dataset: Dataset, known: Mapping[str, Ratio]) -> dict[str, float]:
    """The ratio of every run: from stretches of constant commands if there are, which tell it best.

    A run that shows no beat gets the mean of the others.
    """
    ratios = {run: ratio.value for run, ratio in known.items()}
    ratios |= {run: ratio for run, (ratio, _) in by_run(beats_of(dataset)).items()}
    mean = float(np.mean(list(ratios.values())))
    return {run.id: ratios.get(run.id, mean) for run in dataset.runs}


def _uneven(ratios: Sequence[Ratio]) -> float | None:
    """The p-value of runs that beat differently; None if they do not."""
    if len(ratios) < 2:
        return None
    values = np.array([ratio.value for ratio in ratios])
    weights = np.array([ratio.sd**2 + CHECKS.ratio_bias**2 for ratio in ratios]) ** -1
    square = float(weights @ (values - weights @ values / weights.sum()) ** 2)
    p = float(chdtrc(len(values) - 1, square))
    differ = np.std(values, ddof=1) > CHECKS.uneven_ratios
    return p if differ and p < CHECKS.uneven_ratios_level else None


def _off(ratio: Ratio) -> bool:
    error = float(np.hypot(ratio.sd, CHECKS.ratio_bias))
    return abs(ratio.value - 1.0) > max(CHECKS.sure_ratio_sd * error, CHECKS.smallest_ratio_error)


def _clock_or_beat(
    dataset: Dataset,
    whole: Ratio,
    rng: np.random.Generator,
) -> Fine:
    """Which of the two a common ratio is."""
    error = float(np.hypot(whole.sd, CHECKS.ratio_bias))
    reach = POLICY.interval_reach
    half = reach * error
    p = float(2.0 * ndtr(-abs(whole.value - 1.0) / error))
    interval = (whole.value - half, whole.value + half)
    slow, common = clock(whole.value), beat({"": whole.value})
    scale = _scale(dataset, rng)
    if scale is None:
        return Fine(common, interval, p, (slow,), False)
    apart = abs(scale.value - (whole.value - 1.0)) / np.hypot(scale.error, whole.sd)
    if not scale.found or apart > reach:
        # Angles may grow by an error of their own: a scale that is not the beat's is no clock.
        excluded = bool(apart >= CHECKS.one_clock_sd)
        return Fine(common, interval, p, () if excluded else (slow,), excluded and not scale.found)
    changes = _one_clock_or_two(dataset, whole.value)
    return Fine(changes[0], interval, scale.p, tuple(changes[1:]), True)


def _scale(dataset: Dataset, rng: np.random.Generator) -> Estimate | None:
    """By how much angles, or else positions, grow faster than rates say."""
    tested = check_consistency(recorded(dataset), rng).tested
    for name in ("attitude", "position"):
        found = next((t.estimate("scale") for t in tested if t.name == name), None)
        if found is not None:
            return found
    return None


def _one_clock_or_two(dataset: Dataset, ratio: float) -> list[Change]:
    """The clock of the whole log, or that of the measurements; both where times do not tell."""
    one, two = clock(ratio), skew(ratio, 0.0, of_commands=False)
    aligner = Aligner.of(dataset)
    if aligner is None:
        return [one, two]
    windows = aligner.windows(ratio)
    gain = (
        0.5 * windows * (aligner.left((1.0 / ratio, 0.0), ratio) - aligner.left((1.0, 0.0), ratio))
    )
    if abs(gain) < CHECKS.clock_evidence:
        return [one, two] if gain > 0.0 else [two, one]
    return [one] if gain > 0.0 else [two]
