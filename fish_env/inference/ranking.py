"""Causes by how well they predict runs left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from fish_env.arrays import FloatArray
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import CauseId
from fish_env.inference.left_out import left_out_scores
from fish_env.inference.policy import POLICY


@dataclass(frozen=True)
class Ranked:
    """How much better one cause predicts runs than the baseline does.

    Attributes:
        cause: which.
        score: log score of all runs, each left out in turn, above that of the baseline under the
            same noise.
        interval: 95 % interval of the score over runs like these.
    """

    cause: CauseId
    score: float
    interval: tuple[float, float]


def ranking_of(tried: Sequence[Explanation], base: Explanation) -> tuple[Ranked, ...]:
    """Explanations by how well they predict runs left out, the best first.

    Args:
        tried: explanations with one cause more than ``base``.
        base: what they are judged against; a single run can be left out of nothing.
    """
    if len(base.fit.filtered) < 2:
        return ()
    before = left_out_scores(base)
    found = [_ranked(e.causes[-1], left_out_scores(e) - before) for e in tried]
    return tuple(sorted(found, key=lambda r: -r.score))


def _ranked(cause: CauseId, gains: FloatArray) -> Ranked:
    """A cause by what it gains in each run (runs,)."""
    count, total = len(gains), float(gains.sum())
    half = float(stdtrit(count - 1, POLICY.interval_ends[1]) * gains.std(ddof=1) * np.sqrt(count))
    return Ranked(cause, total, (total - half, total + half))
