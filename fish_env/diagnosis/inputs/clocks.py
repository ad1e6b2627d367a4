"""Clocks and beats that may be off, each a reading with its size.

The hull sways with the tail, so its sway along the commanded phase says how fast the tail beat by
the clock of the measurements. Angles and positions against rates and speeds say how fast that clock
ran. When commands change, the answers of the fish and the change of beat say when that was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fish_env.data.schema import Dataset
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clock_changes import beat, clock
from fish_env.diagnosis.inputs.orders import Stroke, strokes_under
from fish_env.diagnosis.inputs.ratios import beat_ratio, clock_ratio
from fish_env.diagnosis.inputs.skews import Aligner, near_skew, skews
from fish_env.diagnosis.inputs.weighing import Scales, Weighed
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.recorded import recorded
from fish_env.rigidbody.gridded import gridded


def strokes_of(dataset: Dataset) -> dict[str, Stroke]:
    """The strokes of all runs that have a channel which sways."""
    return strokes_under(gridded(recorded(dataset)), [run.commands for run in dataset.runs])


def changes_of_clocks(dataset: Dataset, scales: Scales, now: Weighed) -> list[Change]:
    """Clocks and beats that the data may have.

    Args:
        dataset: as it is read now.
        scales: to weigh it.
        now: what it weighs.
    """
    found: list[Change] = []
    gross = clock_ratio(now)
    if gross is not None and abs(np.log(gross)) > CHECKS.gross_clock:
        found.append(clock(gross))
    unclear = 1.0 - CHECKS.clear_sway
    astray = [run for run, left in now.beats.items() if np.mean(left) > unclear]
    if astray:
        found += _beats(strokes_of(dataset), astray)
    aligner = Aligner.of(dataset)
    if aligner is None:
        return found
    near = near_skew(aligner)
    if near is not None or 2 * len(astray) > len(dataset.runs):
        found += skews(
            aligner, scales.simulator, near if 2 * len(astray) <= len(dataset.runs) else None
        )
    return found


def _beats(strokes: Mapping[str, Stroke], astray: Sequence[str]) -> list[Change]:
    """Beats, or clocks, of all runs alike and of some runs."""
    found: list[Change] = []
    whole = beat_ratio(list(strokes.values()))
    if whole is not None:
        found += [beat({"": whole.value}), clock(whole.value)]
    single = {run: beat_ratio([strokes[run]]) for run in astray if run in strokes}
    known = {run: ratio.value for run, ratio in single.items() if ratio is not None}
    alike = whole is not None and len(astray) == len(strokes)
    if known and not (alike and _close(list(known.values()))):
        found.append(beat(known))
        values = list(known.values())
        if _close(values) and len(known) < len(strokes):
            found.append(clock(float(np.mean(values)), tuple(known)))
    return found


def _close(values: Sequence[float]) -> bool:
    return bool(np.ptp(values) < CHECKS.alike_beats * np.mean(values))
