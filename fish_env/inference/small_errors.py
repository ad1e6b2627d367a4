"""An explanation among small errors: all that is not in it acts a little.

Real vehicles are wrong in five to ten small ways at once. If all else is taken to be exact, what
makes up for some of these seems to act, and estimates are surer than they should be. So every other
effect is given a size that is small and unknown, in the linear model around a fit, and integrated
out. Source: random effects of a linear model, with the evidence of Bishop (2006), Pattern
Recognition and Machine Learning, section 3.5.1.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.changes import residual_changes
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import Free
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Probe, mildest, phase_of, share_of_usual
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector

SHARES = (0.0, 0.125, 0.25, 0.5, 1.0)
"""Of their usual spread that small errors may have, each twice the one before."""


@dataclass(frozen=True, eq=False)
class SmallErrors:
    """What small errors change in the residuals of a fit, in units of their usual size.

    Attributes:
        fit: the fit that they are beside.
        names: (m,) effect of each.
        followed: (n, m) how the free parameters of the fit follow it.
        information: (m, m) about their sizes, after a refit.
        score: (m,) gradient by their sizes.
    """

    fit: Fit
    names: tuple[str, ...]
    followed: FloatArray
    information: FloatArray
    score: FloatArray

    @classmethod
    def of(cls, fit: Fit) -> SmallErrors:
        """Of every effect that is looked for and not in a fit, at any setting that shows."""
        settings, count = _settings(fit.problem, fit.effects), len(fit.ids)
        if not settings:
            return cls(fit, (), np.empty((count, 0)), np.empty((0, 0)), np.empty(0))
        columns = residual_changes(fit, [(name, probe) for name, probe, _ in settings])
        columns = columns * [unit for _, _, unit in settings]
        energy = np.where(np.isfinite(columns).all(axis=0), np.sum(columns**2, axis=0), 0.0)
        shown = np.flatnonzero(energy > POLICY.smallest_change).tolist()
        columns = columns[:, shown]
        projector = Projector(fit)
        followed = projector.coefficients(columns)
        left = columns - projector.lin.slopes @ followed
        return cls(
            fit,
            tuple(settings[i][0] for i in shown),
            followed,
            projector.information(followed, left),
            projector.score(followed, left),
        )

    def gain(self, without: Collection[str] = ()) -> float:
        """What they explain, in -2 log evidence, less what their sizes cost; zero if that is more.

        Args:
            without: effects that are taken to be off.
        """
        kept = [i for i, name in enumerate(self.names) if name not in without]
        at = self.information[np.ix_(kept, kept)], self.score[kept]
        return max(_gain(*at, share) for share in SHARES)

    @cached_property
    def share(self) -> float:
        """The likeliest share of the usual spread that their sizes have; zero if none shows."""
        return max(SHARES, key=lambda share: _gain(self.information, self.score, share))

    def widened(self) -> Fit:
        """The fit with its estimates as sure as such errors leave them.

        They are off by where the likeliest sizes of these errors would take them, and by as much as
        is unknown of these sizes.
        """
        fit = self.fit
        if self.share == 0.0:
            return fit
        moved = Free(fit.problem, fit.effects, fit.released).scale() @ self.followed
        unknown = np.linalg.inv(self.information + np.eye(len(self.names)) / self.share**2)
        likeliest = unknown @ self.score
        spread = moved @ (unknown + np.outer(likeliest, likeliest)) @ moved.T
        further = POLICY.interval_reach * np.sqrt(np.diag(spread))
        profiles = {}
        for id, value, more in zip(fit.ids, fit.estimates, further, strict=True):
            if id in fit.profiles:
                below, above = np.hypot(np.array(fit.profiles[id]) - value, more)
                profiles[id] = float(value - below), float(value + above)
        return replace(fit, covariance=fit.covariance + spread, profiles=profiles)


def _gain(information: FloatArray, score: FloatArray, share: float) -> float:
    """Gain in -2 log evidence by sizes whose spread is a share of the usual one."""
    if share == 0.0:
        return 0.0
    posterior = np.eye(len(score)) + share**2 * information
    explained = share**2 * float(score @ np.linalg.solve(posterior, score))
    return explained - float(np.linalg.slogdet(posterior)[1])


def _settings(problem: Problem, known: tuple[str, ...]) -> list[tuple[str, Probe, float]]:
    """Small settings of effects that are not known to act, and the usual error as a multiple.

    Any of them may act, and a few do: its variance is that share of what it is if it acts. Which
    oscillations there may be is left out, as they are countless.
    """
    sd = POLICY.small_error * np.sqrt(POLICY.small_errors)
    return [
        (name, probe, float(sd / share_of_usual(effect, probe)))
        for name, effect in problem.known.items()
        if effect.diagnosed and name not in known and not phase_of(effect)
        for probe in mildest(effect, problem.longest_step)
    ]
