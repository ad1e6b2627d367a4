"""Effects that other effects have as their limit, and what does the same together."""

from __future__ import annotations

from collections.abc import Mapping

from fish_env.inference.effects import Parts
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectName, EffectParameterId
from fish_env.inference.problem import Problem

Values = Mapping[EffectParameterId, float]


def limit_of(own: Fit, cause: CauseId) -> EffectName | None:
    """The effect that a cause has as its limit, see :func:`limit_at`; None without one."""
    if isinstance(cause, Coefficient) or cause not in own.effects:
        return None
    return limit_at(own.problem, cause, own.point.effects)


def limit_at(problem: Problem, effect: EffectName, values: Values) -> EffectName | None:
    """The one effect that another does nearly the same as, if some parameter hardly acts.

    Args:
        problem: knows the effects.
        effect: the effect.
        values: of its parameters, and perhaps of others.
    """
    parts = parts_of(problem, effect, values)
    return EffectName(next(iter(parts))) if len(parts) == 1 else None


def parts_of(problem: Problem, effect: EffectName, values: Values) -> Parts:
    """What together does nearly the same as an effect with these values, if all of it is known."""
    known = problem.known
    ids = (EffectParameterId(effect, p.name) for p in known[effect].parameters)
    parts = known[effect].in_parts({id.name: values[id] for id in ids})
    return parts if {*parts} <= {*known} else {}
