"""A fish with its effects: the kernel that runs it, and the record that the kernel reads."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.effects.kinds import together_with
from fish_env.effects.registry import catalogue, get_effect, load_effect_file
from fish_env.errors import EffectError, ParameterError, ScheduleError
from fish_env.model.composition import Composition
from fish_env.model.effect import Effect
from fish_env.model.runtime import Kernels, kernels
from fish_env.params.packing import PATHS, RECORD_FIELDS, pack_tables, pack_values
from fish_env.params.schema import FishParams
from fish_env.params.tables import analytic_tail
from fish_env.reading import is_number, printable, short, shown

LONGEST_NAME = 200
"""Bytes of an effect's name that a file can have with ".py" behind it."""
LONGEST_MESSAGE = 1000
EffectValues = Mapping[str, Mapping[str, float]]
PREFIX = "effects."
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-6, 0.1
"""Of the physics. With shorter steps, rounding errors exceed the gain in accuracy."""


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """Baseline parameters plus effects, ready to run.

    Attributes:
        fish: the parameters.
        effects: complete parameter values of the effects that are on, by name.
        declared: the effects the kernel contains, in the order their hooks run: those of the
            smallest kind that has all that are on (see :mod:`fish_env.effects.kinds`). None for a
            fish without effects: then the lean kernel runs it.
        measurement: effects that act on what is recorded, not on the motion, in catalogue order.
    """

    fish: FishParams
    effects: EffectValues
    declared: tuple[Effect, ...]
    measurement: tuple[Effect, ...]

    @cached_property
    def kernels(self) -> Kernels:
        """Compiled physics of this composition."""
        return kernels(Composition(self.declared, bool(self.fish.tables())))

    @cached_property
    def tables(self) -> FloatArray:
        """Packed coefficient tables of the fish."""
        return pack_tables(self.fish)

    @cached_property
    def record(self) -> FloatArray:
        """Parameter record, shape (parameters, 1)."""
        return self.records({})

    def records(self, changes: Mapping[str, npt.ArrayLike]) -> FloatArray:
        """Records of fish that differ from this one, shape (parameters, N).

        Args:
            changes: path (``body.plane_xy.drag.c0`` or ``effects.current.north``) -> a number, or
                one number per fish.

        Raises:
            ParameterError: a path that the kernel does not read.
        """
        known = set(PATHS.values())
        arrays = {path: np.atleast_1d(np.asarray(v, float)) for path, v in changes.items()}
        values: dict[str, FloatArray | float] = {
            **analytic_tail(self.fish.tables()),
            **self.fish.values(),
        }
        values |= {path: array for path, array in arrays.items() if path in known}
        rows = {name: np.full(1, value) for name, value in self._effect_values().items()}
        for path, array in arrays.items():
            name = path.removeprefix(PREFIX)
            if path not in known and (name == path or name not in rows):
                raise ParameterError(
                    f"'{path}' is not a parameter of {self.fish.name} that this model computes with"
                )
            if path not in known:
                rows[name] = array
        count = max((array.size for array in arrays.values()), default=1)
        base = pack_values(values)
        record = np.empty((len(base) + len(rows), count))
        record[: len(base)] = base
        for row, value in enumerate(rows.values(), start=len(base)):
            record[row] = value
        return record

    def row_of(self, path: str) -> int | None:
        """Row of :meth:`records` with a parameter of an effect; None where the kernel has none."""
        names = [PREFIX + name for name in self._effect_values()]
        return len(RECORD_FIELDS) + names.index(path) if path in names else None

    def _effect_values(self) -> dict[str, float]:
        values: dict[str, float] = {}
        for effect in self.declared:
            complete = self.effects.get(effect.name, effect.neutral)
            values |= {f"{effect.name}.{name}": complete[name] for name in effect.neutral}
        return values

    @property
    def command_delay(self) -> float:
        """Delay of the tail's command (s)."""
        return sum(
            self.effects[effect.name][effect.command_delay]
            for effect in self.declared
            if effect.command_delay is not None and effect.name in self.effects
        )

    def longest_step(self) -> float:
        """Longest physics step that resolves the fastest effect (s)."""
        scales = (
            effect.time_scale(self.effects[effect.name])
            for effect in self.declared
            if effect.time_scale is not None and effect.name in self.effects
        )
        return min(scales, default=float("inf"))

    def check_step(self, dt: float) -> None:
        """Refuse a physics step that no simulation can take, or too long for an effect.

        Raises:
            ScheduleError: no number from 1e-6 to 0.1 s.
            EffectError: too long for an effect's time constant; says the longest step.
        """
        _check_range(dt)
        longest = self.longest_step()
        if dt > longest * (1 + 1e-9):
            raise EffectError(
                f"{self.fish.name}: an effect has a time constant of {longest:g} s, shorter than "
                f"the physics step of {dt:g} s; use dt <= {longest:g}, or switch the effect off (0)"
            )

    def substeps(self, dt: float) -> int:
        """Equal parts of a physics step (s) that resolve the fastest effect; one if it does.

        Raises:
            ScheduleError: no number from 1e-6 to 0.1 s.
            EffectError: an effect needs steps that no simulation can take.
        """
        _check_range(dt)
        longest = self.longest_step()
        if longest < SHORTEST_STEP_S:
            raise EffectError(
                f"{_origin(self.fish)}: an effect has a time constant of {longest:g} s, shorter "
                f"than {SHORTEST_STEP_S:g} s; use a longer one, or switch the effect off (0)"
            )
        return max(1, int(np.ceil(dt / longest * (1.0 - 1e-9))))


def _check_range(dt: float) -> None:
    if not is_number(dt) or not SHORTEST_STEP_S <= dt <= LONGEST_STEP_S:
        raise ScheduleError(
            f"dt = {shown(dt)} s: choose a physics step from {SHORTEST_STEP_S:g} to "
            f"{LONGEST_STEP_S:g} s"
        )


def build_model(
    fish: FishParams,
    effects: EffectValues | None = None,
    user_effects: Iterable[Effect] = (),
    whole_catalogue: bool = False,
    may_come_on: Collection[str] = (),
) -> ExtendedModel:
    """Combine a fish, the effects in its file, and further ones.

    Args:
        fish: parameters; its own ``effects`` are on.
        effects: further effects or other values, by name; they replace the file's.
        user_effects: effects of the caller. An unknown name in the fish's file is looked for
            as ``<name>.py`` beside that file, which is run only if ``fish.trust_effects``.
        whole_catalogue: use the kernel with every effect even if all are off, so that parameters
            of any effect can be changed later without another kernel.
        may_come_on: names of effects whose parameters will be changed later; the kernel has them,
            and those that are named in ``effects``.

    Raises:
        EffectError: an unknown effect or parameter, a value out of bounds, or an effect file that
            is not trusted.
    """
    own = {effect.name: effect for effect in user_effects}
    for name in own.keys() & catalogue().keys():
        raise EffectError(f"effect {name}: the name is taken by a shipped effect, choose another")
    wanted: dict[str, dict[str, float]] = {name: dict(v) for name, v in fish.effects.items()}
    for name, values in (effects or {}).items():
        if not isinstance(name, str) or not isinstance(values, Mapping):
            raise EffectError(f"effect {shown(name)}: give a name and a mapping of parameters")
        wanted[name] = {**wanted.get(name, {}), **values}
    for name in wanted:
        if name not in own and name not in catalogue():
            own[name] = _beside(fish, name)
    found = {name: own.get(name) or get_effect(name) for name in wanted}
    complete = {
        name: _complete(found[name], values, fish if name not in (effects or {}) else None)
        for name, values in wanted.items()
    }
    on = {name: v for name, v in complete.items() if v != found[name].neutral}
    everything = (*catalogue().values(), *own.values())
    moving = [e for e in everything if e.acts_on_motion]
    acting: tuple[Effect, ...] = ()
    if whole_catalogue:
        acting = tuple(moving)
    elif any(e.name in {*on, *own, *may_come_on} for e in moving):
        ours = (e for e in own.values() if e.acts_on_motion)
        acting = (*together_with({*wanted, *may_come_on}), *ours)
    measured = tuple(e for e in everything if e.name in on and e.acts_on_record)
    return ExtendedModel(fish, on, acting, measured)


def _origin(fish: FishParams) -> str:
    return str(fish.source_file or fish.name)


def _complete(
    effect: Effect, values: Mapping[str, float], fish: FishParams | None
) -> dict[str, float]:
    """Values for all parameters; an error names the fish, if its file gave them."""
    try:
        return effect.complete(values)
    except EffectError as error:
        named = "" if fish is None else f"{_origin(fish)}: "
        raise EffectError(f"{named}{short(printable(str(error)), LONGEST_MESSAGE)}") from None


def _beside(fish: FishParams, name: str) -> Effect:
    if fish.source_file is not None and name.isidentifier() and len(name.encode()) <= LONGEST_NAME:
        candidate = fish.source_file.with_name(f"{name}.py")
        if candidate.is_file():
            if not fish.trust_effects:
                raise EffectError(
                    f"{fish.source_file}: its effect '{name}' would run the Python file "
                    f"{candidate}. Code beside data is run only if you trust it: read that file, "
                    "then add --trust-effects (in Python: trust_effects=True)"
                )
            effect = load_effect_file(candidate)
            if effect.name != name:
                raise EffectError(f"{candidate} defines '{effect.name}', its file says '{name}'")
            return effect
    try:
        return get_effect(name)
    except EffectError as error:
        reason = short(printable(str(error)), LONGEST_MESSAGE)
        raise EffectError(
            f"{_origin(fish)}: {reason}; for an effect of your own put {short(printable(name))}.py "
            "beside the fish file"
        ) from None
