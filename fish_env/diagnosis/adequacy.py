"""Does an explanation reach the noise floor? A test against forces of no particular origin.

A wrench that depends on motion, attitude, depth, time, tail phase or commands in any of some forty
simple ways is added, one function and one direction at a time. If the data still ask for one of
them after everything that is free has been refitted, something remains that the model lacks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fish_env.diagnosis.generic_forces import (
    GenericForces,
    generic_forces,
    generic_signals,
    probes,
)
from fish_env.diagnosis.projection import Projector, Signal
from fish_env.diagnosis.screening import null_threshold
from fish_env.effects.extended import PREFIX
from fish_env.identification.estimator import Fit
from fish_env.identification.noise import disturbance_range
from fish_env.model.effect import EffectParameter

FAR_OFF = 10.0
ASTONISHING = 4.9
"""Prior standard deviations that one coefficient in a million passes."""
LEVEL = 0.003
"""For white residuals. A false alarm here spoils a right answer of any kind, and 97 % are to be
right, so it gets a tenth of that. How far disturbances of other colours go is measured by
scripts/calibrate_adequacy.py."""
CERTAIN = 2.0
"""Multiple of the threshold's log p-value that no chance reaches: it came to 1.0 at most in 60 data
sets of that calibration."""


@dataclass(frozen=True)
class Misfit:
    """One function and direction that the data ask for.

    Attributes:
        function: what the missing wrench depends on.
        direction: which force or moment.
        log_p: of this one test, in logarithm.
        size: root mean square of the wrench asked for (N or N m).
    """

    function: str
    direction: str
    log_p: float
    size: float


@dataclass(frozen=True)
class Adequacy:
    """Result of the test.

    Attributes:
        reached: nothing is asked for beyond chance, and the disturbance is one that a tank makes.
        threshold: log p-value for that.
        misfits: what is asked for most, strongest first.
        strained: what had to leave what is plausible to explain the data, the disturbance or a
            cause's own numbers; empty where nothing did.
        refuted: what the log likelihood of runs that were not fitted gains by what is asked for,
            where that is nothing and so much can be chance; else None.
    """

    reached: bool
    threshold: float
    misfits: tuple[Misfit, ...]
    strained: tuple[str, ...] = ()
    refuted: float | None = None

    @property
    def slight(self) -> bool:
        """Whether something is asked for, but not more than chance has been seen to ask for."""
        if self.reached or self.strained:
            return False
        return self.misfits[0].log_p > CERTAIN * self.threshold

    def judged(self, gain: float) -> Adequacy:
        """The same, after other runs were asked.

        A force that acts acts in all runs, one that chance made up foretells those worse that did
        not choose it. Where a force is asked for as much as the threshold demands, and a quarter of
        the runs judges, either way of being wrong has a chance of about 8 %.

        Args:
            gain: what the log likelihood of those runs gains by what is asked for.
        """
        if not self.slight or gain > 0.0:
            return self
        return replace(self, reached=True, refuted=gain)


def strains(fit: Fit) -> tuple[str, ...]:
    """How the fitted disturbance leaves what is plausible: a misfit with another name."""
    noise, within = fit.noise, disturbance_range(fit.problem.fish)
    found = []
    if noise.force_sd > 0.98 * within.force[1]:
        found.append(f"a disturbing force of {1e3 * noise.force_sd:.0f} mN or more")
    if noise.moment_sd > 0.98 * within.moment[1]:
        found.append(f"a disturbing moment of {1e3 * noise.moment_sd:.2g} mN m or more")
    return tuple(found)


def implausible(fit: Fit) -> tuple[str, ...]:
    """Numbers of the causes that nobody would believe: their nearest relative is what acts.

    A coefficient more than :data:`FAR_OFF` prior deviations off, or as far as physics lets it go (a
    hull without lift). Alone it may be a slip in the fish's file; beside an effect, one that is
    :data:`ASTONISHING` makes up for what the effect does not do. An effect of a sign that it cannot
    have, or :data:`FAR_OFF` times as strong as the strongest that is plausible, or of a shape far
    from the plausible ones. A coefficient that does what an effect does may go as far as the
    effect.
    """
    paths = fit.problem.baseline.paths
    effects_too = {path for effect in fit.problem.known.values() for path in effect.equals}
    farthest = ASTONISHING if fit.effects else FAR_OFF
    found = [
        f"{path} {abs(z):.0f} prior standard deviations from where it is known to be"
        for path, z in zip(paths, fit.point.z, strict=True)
        if path in set(fit.released) - effects_too and (abs(z) > farthest or path in fit.at_bounds)
    ]
    for name in fit.effects:
        for parameter in fit.problem.known[name].parameters:
            path = f"{PREFIX}{name}.{parameter.name}"
            value, unit = fit.point.effects[path], parameter.unit
            beyond = (
                _out_of_place(parameter, value)
                if parameter.shapes
                else _beyond(parameter, fit.interval(path))
            )
            if beyond:
                found.append(f"{name} with a {parameter.name} of {value:.2g} {unit}")
    return tuple(found)


def _out_of_place(parameter: EffectParameter, value: float) -> bool:
    """Whether a shape is far from any plausible one: a tether to another town is a weight."""
    low, high = parameter.plausible
    return bool(abs(value - 0.5 * (low + high)) > 1.5 * (high - low))


def _beyond(parameter: EffectParameter, interval: tuple[float, float]) -> bool:
    """Whether an interval lies wholly outside what could be, seen from neutral."""
    neutral, (low, high) = parameter.neutral, parameter.plausible
    if not np.isfinite(neutral):
        return interval[1] < low / FAR_OFF
    below, above = min(low - neutral, 0.0), max(high - neutral, 0.0)
    return bool(interval[0] > neutral + FAR_OFF * above or interval[1] < neutral + FAR_OFF * below)


def adequacy(fit: Fit, rng: np.random.Generator, tolerated: float = 0.0) -> Adequacy:
    """Test a fit against forces of no particular origin.

    Args:
        fit: the explanation.
        rng: for the null distribution.
        tolerated: evidence (in -2 log likelihood) that an error of the simulation may make up.
    """
    forces, signals = _asked(fit)
    threshold = null_threshold([s for _, s in signals], rng, LEVEL)
    unit = probes(forces.columns)
    found = []
    for column, signal in signals:
        amount = float(abs(signal.score[0] / signal.projected[0, 0]) * unit[column])
        found.append(Misfit(*forces.words(column), signal.log_p, amount))
    found.sort(key=lambda m: m.log_p)
    strongest = max((signal.statistic for _, signal in signals), default=0.0)
    reached = not found or found[0].log_p >= threshold or strongest < tolerated
    strained = (*strains(fit), *implausible(fit))
    return Adequacy(reached and not strained, threshold, tuple(found[:8]), strained)


def strongest_alarm(fit: Fit, rng: np.random.Generator) -> tuple[float, float]:
    """The smallest log p-value, and the threshold it has in white residuals: to calibrate by."""
    signals = [signal for _, signal in _asked(fit)[1]]
    return min(s.log_p for s in signals), null_threshold(signals, rng, LEVEL)


def _asked(fit: Fit) -> tuple[GenericForces, list[tuple[int, Signal]]]:
    """Forces along the fitted runs, and what the data say of each."""
    fit = fit.extrapolated
    forces = generic_forces(fit.problem.runs, fit.filtered)
    return forces, list(generic_signals(fit, forces, Projector(fit)))
