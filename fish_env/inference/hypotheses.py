"""What can be estimated and what can be wrong, as types; their text is for files and messages.

A cause is an effect that acts, or a coefficient that is wrong. A parameter's text is
``effects.<effect>.<parameter>``, or the path of a coefficient in the vehicle's parameter file. A
cause's text is the name of the effect, or ``parameter:<path>``. What is listed in order is listed
in the order of the text.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import NewType, TypeAlias

EffectName = NewType("EffectName", str)
"""Name of an effect, as the cause that it acts."""
EFFECTS, WRONG = "effects.", "parameter:"
"""What the text of an effect's parameter begins with, and that of a coefficient as a cause."""


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient of the baseline; as a cause: it is further off than its prior allows.

    Attributes:
        path: in the vehicle's parameter file.
    """

    path: str

    def __str__(self) -> str:
        """As files, reports and messages write the parameter."""
        return self.path


@dataclass(frozen=True, slots=True)
class EffectParameterId:
    """A parameter of an effect.

    Attributes:
        effect: name of the effect.
        name: of the parameter.
    """

    effect: str
    name: str

    def __str__(self) -> str:
        """As files, reports and messages write the parameter."""
        return f"{EFFECTS}{self.effect}.{self.name}"


ParameterId: TypeAlias = Coefficient | EffectParameterId
CauseId: TypeAlias = EffectName | Coefficient


def name_of(cause: CauseId) -> str:
    """A cause as files, reports and messages write it."""
    return f"{WRONG}{cause.path}" if isinstance(cause, Coefficient) else cause


def effect_names(*names: str) -> tuple[EffectName, ...]:
    """Names of effects as causes."""
    return tuple(map(EffectName, names))


def listed(causes: Iterable[CauseId], word: str = ", ") -> str:
    """Some causes as messages list them, in the order given."""
    return word.join(map(name_of, causes))


def short_name(written: str) -> str:
    """A cause's text from a file, without what says that it is a coefficient."""
    return written.removeprefix(WRONG)


def effects_of(parameters: Iterable[EffectParameterId]) -> set[str]:
    """Names of the effects that some parameters belong to."""
    return {parameter.effect for parameter in parameters}


def of_effects(
    values: Mapping[EffectParameterId, float], effects: Collection[str]
) -> dict[EffectParameterId, float]:
    """Those of effect parameters' values that belong to some effects."""
    return {p: value for p, value in values.items() if p.effect in effects}
