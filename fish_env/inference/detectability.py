"""How small an effect may be and still be found by the screen: simulated at that very size.

The screen's signals come from probes of plausible size. What can just be found is often a
hundredth of that, where a signal may have another direction and grow by another power. So each
size is simulated again, and corrected until the screen's test would find it with power 0.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.inference import tails
from fish_env.inference.changes import Jobs, residual_changes
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import Free
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Probe
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import Screen, smallest_detectable

ROUNDS, MORE_ROUNDS = 3, 5
"""The further ones are for effects that do nothing at first: a limit that is never met."""
SILENT = 1e-9
"""Share of the energy wanted below which an effect does nothing."""
STEEP, STEEPEST = 4.0, 100.0
"""Largest power that is believed, and that just above a size that does nothing."""
TOLERANCE = 0.05
"""Sizes are corrected until they change by less than this share."""
SMOOTH = 2.0
"""Power of its size by which the energy of a small signal grows."""
FADING = 1.5
"""One that grows by a smaller power has a part that does not fade with the size: an error of the
simulation's step, or a limit on something that jumps."""
ALIKE = 0.1
REFITS = 2
NEAR = 0.2
"""Coefficients that move by less, in prior standard deviations, stay on the tangent there."""


@dataclass(frozen=True, eq=False)
class Setting:
    """One parameter that switches an effect on, with the others neutral.

    Attributes:
        signal: the alternative of the screen that it starts from.
        index: which of its settings.
        parameter: name of the parameter.
        neutral: value at which the effect is off.
    """

    signal: Signal
    index: int
    parameter: str
    neutral: float

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.signal.cause.effect

    def probe(self, multiple: float) -> Probe:
        """The setting with so many times its signal, if that were in proportion."""
        probe = dict(self.signal.cause.probes[self.signal.probe][self.index])
        there = probe[self.parameter]
        probe[self.parameter] = (
            there / float(np.sqrt(multiple))
            if np.isinf(self.neutral)
            else self.neutral + multiple * (there - self.neutral)
        )
        return probe

    def size(self, multiple: float) -> float:
        """Departure from neutral; the value itself where neutral is infinite."""
        value = self.probe(multiple)[self.parameter]
        return float(value if np.isinf(self.neutral) else abs(value - self.neutral))


def in_proportion(settings: Sequence[Setting], threshold: float) -> FloatArray:
    """Multiples (n,) of the probes that are found with power 0.8 if signals keep their shape."""
    return np.array([smallest_detectable(s.signal, s.index, threshold) for s in settings])


def simulated(fit: Fit, screen: Screen, settings: Sequence[Setting]) -> FloatArray:
    """Multiples (n,) of the probes that the screen finds with power 0.8.

    No size is published that the simulation is too coarse for. Where a signal does not fade with
    the size, the size is taken in proportion from the probe; where it does not fade there either,
    every size shows that can be simulated, and the probe itself is the answer. Where an effect does
    nothing yet, its size is sought halfway to one that shows.

    Args:
        fit: what the screen was made against.
        screen: signals and threshold.
        settings: what to find the size of.
    """
    step = fit.problem.longest_step
    least = np.array([_least(fit.problem, setting, step) for setting in settings])
    wanted = in_proportion(settings, screen.threshold)
    probe = np.ones(len(settings))
    last, last_energy = probe, np.array([_information(s) for s in settings])
    target = last_energy * wanted**2
    at: FloatArray = np.maximum(wanted, least)
    moving = np.ones(len(settings), bool)
    endless, sought, nothing = ~moving, ~moving, np.zeros(len(settings))
    for turn in range(ROUNDS + MORE_ROUNDS):
        moving &= sought | (turn < ROUNDS)
        energy = _energies(fit, screen, settings, at, moving)
        moving &= np.isfinite(energy)
        silent = moving & (energy < SILENT * target) & (at < last)
        sought |= silent
        nothing = np.where(silent, np.maximum(nothing, at), nothing)
        power = _power(at, energy, last, last_energy)
        suspect = moving & (at <= probe) & (power < FADING)
        halved = _energies(fit, screen, settings, 0.5 * at, suspect)
        endless |= suspect & ~(_power(at, energy, 0.5 * at, halved) >= FADING)
        moving &= ~endless
        believed = np.clip(power, 1.0, np.where(sought, STEEPEST, STEEP))
        with np.errstate(divide="ignore"):
            steps = np.log(target / energy) / (believed if turn else SMOOTH)
        steps = np.where(silent, 0.5 * np.log(last / at), steps)
        last, last_energy = np.where(silent, last, at), np.where(silent, last_energy, energy)
        # A larger size is known to do nothing, wherever the energy seems to lead.
        lowest = np.maximum(np.sqrt(nothing * at), least)
        corrected = np.where(moving, np.maximum(at * np.exp(steps), lowest), at)
        moving &= np.abs(np.log(corrected / at)) > TOLERANCE
        at = corrected
    both = np.concatenate([probe, 2.0 * probe])
    energy, twice = np.split(_energies(fit, screen, [*settings] * 2, both, np.tile(endless, 2)), 2)
    fades = _power(probe, energy, 2.0 * probe, twice) >= FADING
    from_probe = np.where(fades, np.sqrt(target / energy), 1.0)
    return np.where(endless, np.maximum(np.where(least > 0.0, 0.0, from_probe), least), at)


def _power(
    size: FloatArray, energy: FloatArray, other: FloatArray, other_energy: FloatArray
) -> FloatArray:
    """Power of the size by which energy grows; that of a smooth effect where sizes are alike."""
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(energy / other_energy) / np.log(size / other)
    return np.where(np.abs(np.log(size / other)) < ALIKE, SMOOTH, power)


def _least(problem: Problem, setting: Setting, step: float) -> float:
    """Smallest multiple of a probe that the simulation follows; 0 if it follows any."""
    effect = problem.known[setting.effect]
    if effect.is_followed(setting.probe(1e-9), step):
        return 0.0
    multiples = np.geomspace(1e-6, 1.0, 200)
    return next(float(m) for m in multiples if effect.is_followed(setting.probe(m), step))


def _information(setting: Setting) -> float:
    """Noncentrality of the probe itself."""
    signal, i = setting.signal, setting.index
    return float(signal.projected[i, i]) / signal.variance_inflation


def _energies(
    fit: Fit,
    screen: Screen,
    settings: Sequence[Setting],
    multiples: FloatArray,
    asked: BoolArray,
) -> FloatArray:
    """Noncentrality (n,) of the screen's test; NaN where not asked for, or not to be simulated."""
    which = [
        i
        for i in np.flatnonzero(asked).tolist()
        if _allowed(fit.problem, settings[i], multiples[i])
    ]
    energy = np.full(len(settings), np.nan)
    if which:
        jobs = [(settings[i].effect, settings[i].probe(multiples[i])) for i in which]
        for i, change in zip(which, changes(fit, jobs), strict=True):
            if np.isfinite(change).all():
                energy[i] = noncentrality(screen, settings[i], change)
    return energy


def _allowed(problem: Problem, setting: Setting, multiple: float) -> bool:
    """Whether the physics allows the size."""
    value = setting.probe(multiple)[setting.parameter]
    bounds = {p.name: (p.lower, p.upper) for p in problem.known[setting.effect].parameters}
    low, high = bounds[setting.parameter]
    return bool(low <= value <= high)


def changes(fit: Fit, jobs: Jobs) -> FloatArray:
    """What settings of effects change in the residuals, shape (n, D), for a refit to follow.

    A refit follows a large change along a curve, not along its tangent. So each setting is
    simulated again with the coefficients where the tangent leads, and what they explain there is
    added back: projecting the result leaves what a refit would leave after as many steps.
    """
    projector, own = Projector(fit), Free(fit.problem, (), fit.released)
    start = np.repeat(fit.point.z[:, None], len(jobs), axis=1)
    seen = residual_changes(fit, jobs, start).T
    followed = projector.coefficients(seen.T)[: len(start)]
    far = np.flatnonzero(np.abs(followed).max(axis=0) > NEAR)
    for _ in range(REFITS):
        if not far.size:
            break
        there = np.array([own.bounds.clip(z) for z in (start[:, far] - followed[:, far]).T]).T
        moved = residual_changes(fit, [jobs[i] for i in far.tolist()], there).T
        moved -= (projector.lin.slopes[:, : len(start)] @ (there - start[:, far])).T
        seen[far] = np.where(np.isfinite(moved), moved, seen[far])
        on = projector.coefficients(seen[far].T)[: len(start)]
        further = np.abs(on - followed[:, far]).max(axis=0) > NEAR
        followed[:, far] = on
        far = far[further]
    return seen


def noncentrality(screen: Screen, setting: Setting, change: FloatArray) -> float:
    """What a change (D,) of the residuals adds to the screen's tests of an effect, at its best.

    In terms of the setting's own test: one of more degrees of freedom has to see more for the same
    power.
    """
    needed = partial(tails.noncentrality, screen.threshold, power=POLICY.power)
    own, found = needed(setting.signal.freedom), 0.0
    for signal in screen.signals:
        if signal.cause.id == setting.effect:
            score = signal.left.T @ change
            energy = (
                float(score @ np.linalg.solve(signal.projected, score)) / signal.variance_inflation
            )
            found = max(found, energy * own / needed(signal.freedom))
    return found
