"""Steps in which runs are simulated: of published estimates, and longer ones to search in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from typing import Any, TypeVar

import numpy as np

from fish_env.effects.extended import ExtendedModel
from fish_env.identification.runs import FINER, RunData
from fish_env.inference.hypotheses import EffectParameterId, effects_of
from fish_env.inference.problem import Problem
from fish_env.model.effect import Effect

S = TypeVar("S", bound="Stepped")


class Stepped(Problem):
    """Runs of a fish, simulated in steps that suit what is asked of them.

    Attributes:
        unrefined: whether effects that make the tail's rate jump have the steps of all others.
        cut: whether long steps are cut also without such effects.
    """

    runs: tuple[RunData, ...]
    known: Mapping[str, Effect]
    model: ExtendedModel
    unrefined: bool
    cut: bool

    def with_runs(self: S, runs: Sequence[RunData]) -> S:
        """The same problem on other runs; this one on its own."""
        return self if self.runs == tuple(runs) else self._but(runs=tuple(runs), _filters={})

    def _but(self: S, **changes: Any) -> S:
        other = copy(self)
        vars(other).update(changes)
        return other

    @property
    def longest_step(self) -> float:
        """Longest RK4 step (s) between samples."""
        return max(float(np.max(np.diff(run.clock) / run.substeps[1:])) for run in self.runs)

    def without_refinement(self: S) -> S:
        """The same problem without finer steps for effects that make the tail's rate jump."""
        return self._but(unrefined=True)

    def with_refinement(self: S) -> S:
        """The same problem in usual steps, finer for effects that make the tail's rate jump."""
        usual = self.with_runs([run.in_usual_steps() for run in self.runs])
        return usual._but(unrefined=False) if usual.unrefined else usual

    def is_coarse(self, effects: Iterable[EffectParameterId]) -> bool:
        """Whether steps are longer than these effect parameters need (see the protocol)."""
        return self._long or (self.unrefined and self._jumps(effects_of(effects)))

    def with_long_steps(self: S) -> S:
        """The same problem in steps that will do to compare causes, with the same freedoms."""
        return self.with_runs([run.in_long_steps(self.model.longest_step()) for run in self.runs])

    def refined(self: S) -> tuple[S, int]:
        """The same problem in finer steps, to tell what those of motion with corners get wrong."""
        return self.with_runs([run.in_finer_steps() for run in self.runs]), FINER

    def refines_steps(self, effects: Iterable[EffectParameterId]) -> bool:
        """Whether one of these effect parameters makes the tail's rate jump."""
        return self._jumps(effects_of(effects)) and not self.unrefined

    def cuts_steps(self, effects: Iterable[EffectParameterId]) -> bool:
        """Whether steps are shorter than others: long ones are cut, usual ones refined."""
        if self._long:
            return self.cut or self._jumps(effects_of(effects))
        return self.refines_steps(effects)

    def in_steps_of(self: S, names: Iterable[str]) -> S:
        """The same problem in the steps that it has with these effects (see the protocol)."""
        cuts = self._long and not self.cut and self._jumps(names)
        return self._but(cut=True) if cuts else self

    def _jumps(self, names: Iterable[str]) -> bool:
        return self.is_nonsmooth({*names, *self.model.effects})

    @property
    def _long(self) -> bool:
        return any(run.usual_substeps is not None for run in self.runs)

    def is_nonsmooth(self, names: Iterable[str]) -> bool:
        """Whether one of these effects makes the tail's rate jump, whatever the steps."""
        return any(self.known[name].step_error > 0.0 for name in names)
