"""Steps in which runs are simulated: of published estimates, and longer ones to search in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from typing import Any, TypeVar

import numpy as np

from fish_env.effects.extended import ExtendedModel
from fish_env.identification.runs import RunData
from fish_env.inference.problem import Problem
from fish_env.model.effect import Effect

S = TypeVar("S", bound="Stepped")


class Stepped(Problem):
    """Runs of a fish, simulated in steps that suit what is asked of them."""

    runs: tuple[RunData, ...]
    known: Mapping[str, Effect]
    model: ExtendedModel

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

    @property
    def is_coarse(self) -> bool:
        """Whether steps are longer than those of published estimates."""
        return any(run.usual_substeps is not None for run in self.runs)

    def in_usual_steps(self: S) -> S:
        """The same problem in the steps of published estimates."""
        return self.with_runs([run.in_usual_steps() for run in self.runs])

    def with_long_steps(self: S) -> S:
        """The same problem in steps that will do to compare causes, with the same freedoms."""
        return self.with_runs([run.in_long_steps(self.model.longest_step()) for run in self.runs])

    def is_nonsmooth(self, names: Iterable[str]) -> bool:
        """Whether one of these effects makes the tail's rate jump."""
        return any(self.known[name].nonsmooth for name in names)
