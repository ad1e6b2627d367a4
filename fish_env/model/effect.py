"""What an effect is: a declaration with its kernels, composed into the physics by name of stage.

An effect adds to the baseline model at one or more *stages* of an evaluation. Its hook for a
stage takes the value so far and returns the new one (``wrench`` hooks return what they add):

=============== ======================================================== =================
stage           hook                                                     value
=============== ======================================================== =================
``inputs``      (inputs, time, fish, e)                                  Inputs
``tail``        (tail, inputs, phase, time, fish, e)                     Tail
``barycentre``  (centre, place, inputs, time, fish, e)                   Barycentre
``water``       (water, place, time, e)                                  Vector, inertial
``tail_inflow`` (motion, fish, e)                                        Motion
``tail_force``  (force, motion, tail, fish, e)                           Vector, body
``body_drag``   (factor, motion, fish, e)                                float
``wrench``      (motion, tail, inputs, centre, fish, e)                  Wrench, body
``inertia``     (inertia, tail, fish, e)                                 Inertia
=============== ======================================================== =================

``e`` is the named tuple of the effect's parameters. A hook named in ``states`` takes a further
argument, the tuple of the effect's own states, and returns ``(value, tuple of derivatives)``.
At neutral parameters a hook must return its value unchanged to the last bit.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, isnan
from pathlib import Path
from typing import Any

from fish_env.errors import EffectError

STAGES = (
    "inputs",
    "tail",
    "barycentre",
    "water",
    "tail_inflow",
    "tail_force",
    "body_drag",
    "wrench",
    "inertia",
)
SECTIONS = (
    "actuation",
    "inertia",
    "hydrodynamics",
    "hydrostatics",
    "surroundings",
    "measurement",
)


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes:
        name: public name, as in files, reports and on the command line.
        unit: SI unit, ``-`` when it has none.
        neutral: value at which the effect is off (may be infinite).
        lower: smallest physically meaningful value.
        upper: largest physically meaningful value.
        plausible: range (low, high) that a real robot of this size may show.
        description: what it is.
    """

    name: str
    unit: str
    neutral: float
    lower: float = -inf
    upper: float = inf
    plausible: tuple[float, float] = (-1.0, 1.0)
    description: str = ""


@dataclass(frozen=True, eq=False)
class Effect:
    """A physical effect that the baseline model leaves out.

    Attributes:
        name: public name.
        section: one of :data:`SECTIONS`.
        summary: one line for a person.
        equation: its equation, in the symbols of the model page.
        source: where the equation comes from.
        parameters: its parameters, in the order hooks read them.
        hooks: stage -> kernel (see the module's table); empty for measurement effects.
        states: stage -> names of the states integrated with the fish (at most one stage).
        initial_states: (inputs, phase, fish, e) -> tuple of the states at the start of a run.
        sample_time: (recorded time array, parameters) -> true time array (measurement).
        measure: (channel arrays by name, parameters) -> channel arrays (measurement).
        time_scale: parameters -> its fastest time constant (s); a physics step must not be longer.
        confusable_with: names of effects with a similar signature.
        file: source file, for effects that users bring.
    """

    name: str
    section: str
    summary: str
    equation: str
    source: str
    parameters: tuple[EffectParameter, ...]
    hooks: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    states: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    initial_states: Callable[..., Any] | None = None
    sample_time: Callable[..., Any] | None = None
    measure: Callable[..., Any] | None = None
    time_scale: Callable[[Mapping[str, float]], float] | None = None
    confusable_with: tuple[str, ...] = ()
    file: Path | None = None

    def __post_init__(self) -> None:
        """Refuse a declaration that could not be composed."""
        if not self.name.isidentifier():
            raise EffectError(f"effect name '{self.name}': use letters, digits and underscores")
        if self.section not in SECTIONS:
            raise EffectError(
                f"effect {self.name}: unknown section '{self.section}', use one of {SECTIONS}"
            )
        unknown = set(self.hooks) - set(STAGES)
        if unknown:
            raise EffectError(
                f"effect {self.name}: no stage {sorted(unknown)}, the stages are {STAGES}"
            )
        if len(self.states) > 1 or set(self.states) - set(self.hooks):
            raise EffectError(f"effect {self.name}: states belong to one of its own hooks")
        if self.states and self.initial_states is None:
            raise EffectError(f"effect {self.name}: give initial_states for its states")

    @cached_property
    def record_type(self) -> type:
        """Named tuple that hooks receive as ``e``."""
        return namedtuple(f"{self.name}_parameters", [p.name for p in self.parameters])

    @property
    def neutral(self) -> dict[str, float]:
        """Parameter values that switch the effect off."""
        return {p.name: p.neutral for p in self.parameters}

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states the effect adds."""
        return next(iter(self.states.values()), ())

    def complete(self, values: Mapping[str, float]) -> dict[str, float]:
        """Values for all parameters, neutral where not given.

        Raises:
            EffectError: an unknown name, not a number, or outside the physical bounds.
        """
        names = [p.name for p in self.parameters]
        for name in values:
            if name not in names:
                raise EffectError(f"effect {self.name}: no parameter '{name}', it has {names}")
        return {p.name: self._checked(p, values.get(p.name, p.neutral)) for p in self.parameters}

    def _checked(self, parameter: EffectParameter, value: float) -> float:
        number = float(value)
        if isnan(number) or not (isfinite(number) or number == parameter.neutral):
            raise EffectError(f"effect {self.name}.{parameter.name}: {value} is not finite")
        if not parameter.lower <= number <= parameter.upper:
            raise EffectError(
                f"effect {self.name}.{parameter.name} = {value} {parameter.unit}: "
                f"choose a value between {parameter.lower} and {parameter.upper}"
            )
        return number
