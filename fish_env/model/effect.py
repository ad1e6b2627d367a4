"""What an effect is: a declaration with its kernels, composed into the physics by name of stage.

An effect adds to the baseline model at one or more *stages* of an evaluation. Its hook for a
stage takes the value so far and returns the new one (``wrench`` hooks return what they add):

=============== ======================================================== =================
stage           hook                                                     value
=============== ======================================================== =================
``density``     (density, place, e)                                      float
``inputs``      (inputs, time, fish, e)                                  Inputs
``tail``        (tail, inputs, phase, time, fish, e)                     Tail
``barycentre``  (centre, place, inputs, time, fish, e)                   Barycentre
``water``       (water, place, time, e)                                  Vector, inertial
``water_rate``  (rate, water, place, time, e)                            Vector, inertial
``tail_inflow`` (motion, fish, e)                                        Motion
``tail_lift``   (coefficient, sine, fish, e)                             float
``tail_force``  (force, motion, tail, fish, e)                           Vector, body
``body_drag``   (factor, motion, fish, e)                                float
``wrench``      (motion, tail, inputs, centre, fish, e)                  Wrench, body
``inertia``     (inertia, tail, fish, e)                                 Inertia
=============== ======================================================== =================

``density`` is that of the water (kg/m^3); every later stage sees the new one in ``fish``.
``water`` is the velocity of the water (m/s), ``water_rate`` its acceleration along its own path,
DU/Dt (m/s^2); ``sine`` that of the tail's incidence. ``e`` is the named tuple of the effect's
parameters. At neutral parameters a hook must return its
value unchanged to the last bit.

A hook may carry numbers of its own through time. *States* obey a differential equation: the hook
takes their tuple as a further argument and returns ``(value, derivatives)``. *Memory* follows a
rule from one physics step to the next, such as "move at most so far": the hook takes the tuple
that the last step left and the time since then (s), and returns ``(value, memory)``, the memory
as it is at this instant; the engine keeps what it is at the end of the step. It is for the drive:
the stages ``inputs`` and ``tail``. A hook with both takes ``(..., e, states, memory, since)`` and
returns ``(value, derivatives, memory)``. A drive that gives way to the water is *loaded*: its tail
hook takes ``(tail, inputs, phase, time, fish, motion, e, ...)``.

Hooks of a stage run in the order of section, ``order`` and name, those of users' effects last.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, isnan
from pathlib import Path
from typing import Any

from fish_env.errors import EffectError
from fish_env.inference.effects import EffectParameter as EffectParameter
from fish_env.inference.effects import Parts, Switched
from fish_env.reading import shown

STAGES = (
    "density",
    "inputs",
    "tail",
    "barycentre",
    "water",
    "water_rate",
    "tail_inflow",
    "tail_lift",
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
LOAD = "load"
"""What a loaded drive needs beside the stages of its hooks."""
FOLLOWED = 0.9
"""Steps of RK4 that a time constant has to last to be followed."""


@dataclass(frozen=True, eq=False)
class Effect(Switched):
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
        memory: stage -> names of the numbers kept from step to step (``inputs`` or ``tail``).
        initial_states: (inputs, tail, fish, e) -> tuple of states, then memory, at the start of a
            run; inputs and tail as the hooks before this one leave them.
        turns: (e) -> whether steps may have to be parted, for ``corner`` and ``settling``.
        corner: (tail, phase, later, later_phase, e, memory, length) -> (when, memory): the tail and
            its phase as the hook gets them when a part of a step begins, and at its end, length (s)
            later -> when in it (s) the rate jumps first, infinite where it does not, and the memory
            with which the hook moves the tail until then.
        settling: (tail, e, states) -> longest part of a step (s) that follows its states, for a
            tail whose states are its angle, or angle and rate.
        command_delay: name of the parameter (s) by which the tail's command is late.
        loaded: whether the hook of the tail takes the motion through the water too.
        varies: whether its parameters change during a run, so that it counts as on throughout.
        order: place among the effects of its section, low ones first.
        sample_time: (recorded time array, parameters) -> true time array (measurement).
        command_time: (recorded time array, parameters) -> true time array, of commands.
        late: parameters -> name of a device, ``camera``, ``inertial`` or ``depth`` -> by how much
            later it shows what was than the true time says (s; measurement).
        low_pass: parameters -> frequency (Hz) of half power of the Butterworth filter of second
            order inside the inertial unit (measurement).
        geometry: parameters -> how sensors sit and look, by the names of
            :data:`fish_env.sensing.geometry.FIELDS` (measurement).
        measure: (channel arrays by name, parameters) -> channel arrays, an affine function of each
            channel by itself (measurement).
        time_scale: parameters -> its fastest time constant (s); longer physics steps are divided.
        drifts_in_phase: whether the tail runs ever further out of step with its command, so that
            what a large size does says little of what a small one does.
        diagnosed: whether a diagnosis looks for it; else it is only simulated, and fitted if asked.
        equals: baseline coefficients (paths) other values of which do exactly the same.
        confusable_with: names of effects with a similar signature.
        parts: parameters -> other effects, with their parameters, that together do nearly the
            same; empty where none do.
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
    memory: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    initial_states: Callable[..., Any] | None = None
    turns: Callable[..., Any] | None = None
    corner: Callable[..., Any] | None = None
    settling: Callable[..., Any] | None = None
    command_delay: str | None = None
    loaded: bool = False
    varies: bool = False
    order: int = 0
    sample_time: Callable[..., Any] | None = None
    command_time: Callable[..., Any] | None = None
    late: Callable[..., Any] | None = None
    low_pass: Callable[..., Any] | None = None
    geometry: Callable[..., Any] | None = None
    measure: Callable[..., Any] | None = None
    time_scale: Callable[[Mapping[str, float]], float] | None = None
    drifts_in_phase: bool = False
    diagnosed: bool = True
    equals: tuple[str, ...] = ()
    confusable_with: tuple[str, ...] = ()
    parts: Callable[[Mapping[str, float]], Parts] | None = None
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
        stages = {*self.states, *self.memory}
        if len(stages) > 1 or stages - set(self.hooks):
            raise EffectError(
                f"effect {self.name}: states and memory belong to one of its own hooks"
            )
        if set(self.memory) - {"inputs", "tail"}:
            raise EffectError(f"effect {self.name}: memory is for hooks of inputs and tail alone")
        if stages and self.initial_states is None:
            raise EffectError(f"effect {self.name}: give initial_states for its states and memory")
        if self.loaded and "tail" not in self.hooks:
            raise EffectError(f"effect {self.name}: a loaded drive has a hook for the tail")
        if self.corner and "tail" not in self.memory:
            raise EffectError(f"effect {self.name}: corner is for a tail with memory")
        if self.settling is not None and "tail" not in self.states:
            raise EffectError(f"effect {self.name}: settling is for a tail with states")
        if (self.turns is None) != (self.corner is None and self.settling is None):
            raise EffectError(f"effect {self.name}: turns goes with corner or settling")
        if self.command_delay not in (None, *self.neutral):
            raise EffectError(f"effect {self.name}: no parameter '{self.command_delay}'")

    @cached_property
    def record_type(self) -> type:
        """Named tuple that hooks receive as ``e``."""
        return namedtuple(f"{self.name}_parameters", [p.name for p in self.parameters])

    @property
    def needs(self) -> frozenset[str]:
        """Stages of its hooks, and :data:`LOAD` of a loaded drive."""
        return frozenset({*self.hooks, *((LOAD,) if self.loaded else ())})

    @property
    def nonsmooth(self) -> bool:
        """Whether it makes the tail's rate jump, so that slopes tell little of large sizes."""
        return self.corner is not None or self.command_delay is not None

    @property
    def acts_on_record(self) -> bool:
        """Whether it changes what is recorded of a motion."""
        times = (self.sample_time, self.command_time, self.late, self.low_pass)
        return any((*times, self.geometry, self.measure))

    @property
    def acts_on_motion(self) -> bool:
        """Whether the kernel must contain it; if not, it acts on what is recorded alone."""
        return bool(self.hooks or self.command_delay)

    def is_followed(self, values: Mapping[str, float], step: float) -> bool:
        """Whether RK4 steps (s) follow it: its shortest time constant is about a step or longer."""
        return self.time_scale is None or self.time_scale(values) >= FOLLOWED * step

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states the effect adds."""
        return next(iter(self.states.values()), ())

    @property
    def memory_names(self) -> tuple[str, ...]:
        """Names of what it keeps from step to step."""
        return next(iter(self.memory.values()), ())

    def complete(self, values: Mapping[str, float]) -> dict[str, float]:
        """Values for all parameters, neutral where not given.

        Raises:
            EffectError: an unknown name, not a number, or outside the physical bounds.
        """
        names = [p.name for p in self.parameters]
        if not isinstance(values, Mapping):
            raise EffectError(
                f"effect {self.name}: {shown(values)}; give parameters, it has {names}"
            )
        for name in values:
            if name not in names:
                raise EffectError(f"effect {self.name}: no parameter '{name}', it has {names}")
        return {p.name: self._checked(p, values.get(p.name, p.neutral)) for p in self.parameters}

    def _checked(self, parameter: EffectParameter, value: float) -> float:
        try:
            number = float("nan") if isinstance(value, (str, bytes, bool)) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = float("nan")
        if isnan(number) or not (isfinite(number) or number == parameter.neutral):
            raise EffectError(f"effect {self.name}.{parameter.name}: {shown(value)} is not finite")
        if not parameter.lower <= number <= parameter.upper:
            raise EffectError(
                f"effect {self.name}.{parameter.name} = {value} {parameter.unit}: "
                f"choose a value between {parameter.lower} and {parameter.upper}"
            )
        return number
