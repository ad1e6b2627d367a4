"""Effects that other effects have as their limit, and what does the same together."""

from __future__ import annotations

from collections.abc import Mapping

from fish_env.inference.effects import EffectParameter, Parts
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


def does_no_more(problem: Problem, effect: EffectName, values: Values, than: CauseId) -> bool:
    """Whether an effect with these values is another cause, and something too faint to be itself.

    It is if the other cause is one of its parts, and all that switches it on is nearer to neutral
    than what is plausible. A tail too stiff to bend, whose servo lags, is a servo that lags.

    Args:
        problem: knows the effects.
        effect: the effect.
        values: of its parameters, and perhaps of others.
        than: the other cause.
    """
    if than not in parts_of(problem, effect, values):
        return False
    switching = problem.known[effect].switching
    return all(_is_faint(p, values[EffectParameterId(effect, p.name)]) for p in switching)


def _is_faint(parameter: EffectParameter, value: float) -> bool:
    """Whether a value lies between neutral and what is plausible."""
    low, high = parameter.plausible
    if low <= parameter.neutral <= high:
        return False
    return value > high if parameter.neutral > high else value < low


def parts_of(problem: Problem, effect: EffectName, values: Values) -> Parts:
    """What together does nearly the same as an effect with these values, if all of it is known."""
    known = problem.known
    ids = (EffectParameterId(effect, p.name) for p in known[effect].parameters)
    parts = known[effect].in_parts({id.name: values[id] for id in ids})
    return parts if {*parts} <= {*known} else {}
