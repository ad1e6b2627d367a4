"""The nominal fish with its tail in step, as far as its beat was measured."""

from __future__ import annotations

from collections.abc import Iterable

from fish_env.identification.series import SeriesProblem
from fish_env.identification.tail_drive import SCALE
from fish_env.inference.hypotheses import EffectParameterId, effects_of
from fish_env.inference.problem import Point


def nominal_point(problem: SeriesProblem, more: Iterable[EffectParameterId] = ()) -> Point:
    """Nominal coefficients, and the tail's frequency as it was measured.

    Args:
        problem: the runs, told the beat that they share.
        more: effect parameters whose effects get their neutral values too.
    """
    own = {id: value for id, value in problem.drive.measured.items() if id != SCALE}
    neutral = problem.neutral(effects_of((*own, SCALE, *more)))
    return Point(problem.start.z, {**neutral, **own, SCALE: problem.drive.scale})
