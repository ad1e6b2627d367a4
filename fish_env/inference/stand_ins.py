"""Sums of generic forces that may stand in for a cause, in the linear model of one fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.adequacy import generic_signals
from fish_env.inference.estimate.free import Free
from fish_env.inference.estimate.information import eliminated
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import CauseId, Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.switched_off import off_values
from fish_env.inference.tails import chi2_log_tail


@dataclass(frozen=True, eq=False)
class Removed:
    """One or more causes taken out of the linear model.

    Attributes:
        loss: by how much -2 log likelihood grows.
        shift: (k,) of their parameters.
        own: (k,) numbers of these among all free ones.
        rest: numbers of the others.
        along: (rest, k) how the others follow.
        freed: (k, k) inverse information about these that forces gain by their absence.
    """

    loss: float
    shift: FloatArray
    own: IntArray
    rest: IntArray
    along: FloatArray
    freed: FloatArray

    def seen(self, pull: FloatArray) -> FloatArray:
        """(k, m) product of what only the causes change with m signals of this pull (n, m)."""
        return np.asarray(pull[self.own] - self.along.T @ pull[self.rest])


class StandIns:
    """Sums of generic forces with which a model may do without one of its causes.

    Args:
        found: causes with their fit.
        threshold: log p-value that each force of a sum has to pass.
    """

    def __init__(self, found: Explanation, threshold: float) -> None:
        self.fit, self.causes, self.threshold = found.fit, found.causes, threshold
        self.projector = Projector(self.fit)
        self._lengths: dict[tuple[CauseId, ...], float] = {}

    def replaced(self, judged: Sequence[CauseId]) -> list[CauseId]:
        """Causes that forces may stand in for: the weakest, then others beside it or such forces.

        Args:
            judged: causes in question.
        """
        found: list[CauseId] = []
        while len(found) < len(judged):
            log_p = self.log_p(found)
            weakest = max((n for n in judged if n in log_p), key=lambda name: log_p[name])
            if log_p[weakest] < self.threshold:
                break
            found.append(weakest)
        return found

    def log_p(self, doubtful: Sequence[CauseId] = ()) -> dict[CauseId, float]:
        """Log p-value of what each cause explains that no sum of forces makes good.

        A cause that forces may stand in for is known no better than these forces. So the best
        description with another cause is compared with the best one without it, of those with all
        doubtful causes, without the first of them, without the first two, and so on.

        Args:
            doubtful: causes that forces may stand in for, weakest first.
        """
        states = [tuple(doubtful[:count]) for count in range(len(doubtful) + 1)]
        best = min(self._length(*state) for state in states)
        log_p = {}
        for name in self.causes:
            if name in doubtful:
                continue
            own = self._numbers(name)
            gap = min(self._length(*state, name) for state in states) - best
            squared = max(gap, 0.0) / self.fit.inflation(own)
            log_p[name] = float(chi2_log_tail(squared, len(own)))
        return log_p

    def _length(self, *without: CauseId) -> float:
        """-2 log likelihood without causes, beside the best sum of forces, and what that costs.

        Forces that outnumber the parameters of the causes pay for each what a force has to explain
        to be believed: of two descriptions that explain as much the shorter one counts. Source:
        minimum description length (Rissanen, 1978), Automatica 14, 465.

        Args:
            without: causes that are out of the model.
        """
        if without not in self._lengths:
            removed = self.removed(*without) if without else None
            explained, forces = self._explained(removed)
            numbers = sum(len(self._numbers(name)) for name in without)
            longer = max(forces - self._fewest - numbers, 0)
            lost = removed.loss if removed else 0.0
            self._lengths[without] = lost - explained - 2.0 * self.threshold * longer
        return self._lengths[without]

    @cached_property
    def _fewest(self) -> int:
        """How many forces are indicated beside all causes."""
        return self._explained(None)[1]

    def _numbers(self, name: CauseId) -> list[int]:
        """Numbers, among all free parameters, of those that switch a cause on."""
        return [self.fit.ids.index(id) for id in off_values(self.fit, name)]

    def left_out(self, name: CauseId) -> Point:
        """Where a cause does nothing, and all other parameters follow in the linear model."""
        own, removed = self.fit, self.removed(name)
        free = Free(own.problem, own.effects, own.released)
        vector = free.pack(own.point)
        vector[removed.own] += removed.shift
        vector[removed.rest] -= removed.along @ removed.shift
        point = free.unpack(free.bounds.clip(vector))
        off = {} if isinstance(name, Coefficient) else own.problem.neutral([name])
        return Point(point.z, {**point.effects, **off})

    def removed(self, *names: CauseId) -> Removed:
        """Causes taken out together.

        A coefficient gets its prior back, and may move as far as that lets it.
        """
        off = {id: value for name in names for id, value in off_values(self.fit, name).items()}
        own = np.array([self.fit.ids.index(id) for id in off])
        gap = np.array(list(off.values())) - self.fit.estimates[own]
        rest, along, left = eliminated(self.projector.hessian, own)
        moves = np.array([isinstance(id, Coefficient) for id in off])
        shift, freed = np.where(moves, 0.0, gap), np.asarray(np.linalg.inv(left))
        z = self.fit.point.z[own[moves]]
        if moves.any():
            held = left[np.ix_(moves, moves)] + np.eye(len(z))
            shift[moves] = -np.linalg.solve(held, z + left[np.ix_(moves, ~moves)] @ shift[~moves])
            freed[np.ix_(moves, moves)] -= np.linalg.inv(held)
        loss = float(shift @ left @ shift + np.sum((z + shift[moves]) ** 2))
        return Removed(loss, shift, own, rest, along, freed)

    @cached_property
    def _pool(self) -> list[Signal]:
        """Forces that are most indicated beside all causes, or without one of them."""
        removed = [None, *map(self.removed, self.causes)]
        best: list[list[tuple[float, int, Signal]]] = [[] for _ in removed]
        forces = self.fit.problem.generic_terms(self.fit)
        for column, signal in generic_signals(forces, self.projector):
            for ranked, one in zip(best, removed, strict=True):
                ranked.append((self._gain(signal, one), column, signal))
                ranked.sort(key=lambda entry: (-entry[0], entry[1]))
                del ranked[POLICY.force_pool :]
        chosen = {column: signal for ranked in best for _, column, signal in ranked}
        return [chosen[column] for column in sorted(chosen)]

    def _gain(self, signal: Signal, removed: Removed | None) -> float:
        info, score = self._system([signal], removed)
        return float(score[0] ** 2 / info[0, 0] / signal.variance_inflation)

    def _system(
        self, signals: Sequence[Signal], removed: Removed | None
    ) -> tuple[FloatArray, FloatArray]:
        """Information (N, N) and score (N,) of forces beside all causes, or without one."""
        left = np.hstack([s.left for s in signals])
        followed = np.hstack([np.asarray(s.followed) for s in signals])
        info = self.projector.information(followed, left)
        score = np.concatenate([s.score for s in signals])
        if removed is not None:
            seen = removed.seen(self.projector.hessian @ followed)
            info = info + seen.T @ removed.freed @ seen
            score = score - seen.T @ removed.shift
        return info, score

    def _explained(self, removed: Removed | None) -> tuple[float, int]:
        """What the best sum of forces explains, in -2 log likelihood, and how many there are.

        They are picked one after another, behind each that may come first. The sum that gives the
        shortest description is the best.
        """
        if not self._pool:
            return 0.0, 0
        info, score = self._system(self._pool, removed)
        inflation = np.array([s.variance_inflation for s in self._pool])
        passing = np.flatnonzero(self._passes(score**2 / np.diag(info) / inflation))
        sums = [self._summed(info, score, inflation, int(first)) for first in passing]
        return max(sums, key=lambda one: one[0] + 2.0 * self.threshold * one[1], default=(0.0, 0))

    def _summed(
        self, info: FloatArray, score: FloatArray, inflation: FloatArray, first: int
    ) -> tuple[float, int]:
        """The sum of forces that begins with one of them, as :meth:`_explained` returns it.

        Args:
            info: (N, N) information about all forces.
            score: (N,) of them.
            inflation: (N,) of their variances.
            first: number of the force that comes first.
        """
        whole, explained = np.diag(info).copy(), 0.0
        for count in range(POLICY.most_forces):
            left = np.diag(info)
            gains = np.where(
                left > POLICY.least_independent_share * whole,
                score**2 / np.maximum(left, 1e-300),
                0.0,
            )
            best = int(np.argmax(gains / inflation)) if count else first
            if not self._passes(gains[best] / inflation[best]):
                return explained, count
            explained += float(gains[best])
            along = info[best] / info[best, best]
            score = score - along * score[best]
            info = info - np.outer(info[best], along)
        return explained, POLICY.most_forces

    def _passes(self, squared: FloatArray) -> BoolArray:
        """Whether forces with these statistics are believed."""
        return np.asarray(chi2_log_tail(squared, 1) < self.threshold)
