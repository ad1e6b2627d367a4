"""Does an explanation reach the noise floor? A test against forces of no particular origin.

A generic force is added, one function of the motion and one direction at a time; the problem
provides them. If one of them is significant after everything that is free has been refitted, the
model lacks something.

Such a force has one size in all runs. What depends on the past, as a wake that leans to one side
for a while, has one that comes and goes: on average it is nothing. So where no steady force is
certain, sizes of its own are asked for in each block of some seconds. A disturbance of any colour
does not go with the motion, and asks for none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fish_env.inference.changes import SETTINGS_AT_ONCE
from fish_env.inference.effects import EffectParameter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.information import block_index, sums_over
from fish_env.inference.evaluation import GenericTerms, LackOfFit
from fish_env.inference.hypotheses import CauseId, Coefficient, EffectName, EffectParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause
from fish_env.inference.projection import Projector, Signal
from fish_env.inference.screening import null_threshold
from fish_env.inference.tails import chi2_log_tail

FAR = "prior standard deviations from where it is known to be"
NOTHING = Cause(EffectName("generic"))


@dataclass(frozen=True)
class Misfit:
    """One generic force that the data indicate.

    Attributes:
        function: what the missing force depends on.
        direction: which force or moment.
        log_p: of this one test, in logarithm.
        amount: root mean square of the force indicated (N or N m), with its sign.
        changing: whether its size comes and goes; the amount is then its root mean square, too.
    """

    function: str
    direction: str
    log_p: float
    amount: float
    changing: bool = False

    @property
    def size(self) -> float:
        """The amount without its sign."""
        return abs(self.amount)


@dataclass(frozen=True)
class Implausible:
    """An implausible estimate.

    Attributes:
        cause: what it is of.
        words: how it is implausible.
    """

    cause: CauseId
    words: str


@dataclass(frozen=True)
class Adequacy:
    """Result of the test.

    Attributes:
        reached: no generic force is significant, and all estimates are plausible.
        threshold: log p-value for that.
        misfits: generic forces indicated, strongest first.
        implausible: disturbance at its limit, and implausible estimates of causes; empty if none.
        refuted: gain in log likelihood of held-out runs by the force indicated, where it is not
            positive and the force may be chance; else None.
        lack: what the fit misses against what repeats differ by, where there are enough.
    """

    reached: bool
    threshold: float
    misfits: tuple[Misfit, ...]
    implausible: tuple[str, ...] = ()
    refuted: float | None = None
    lack: LackOfFit | None = None

    @property
    def short(self) -> bool:
        """Whether the fit misses more than repeats differ by."""
        return self.lack is not None and self.lack.p_value < POLICY.adequacy_level

    @property
    def slight(self) -> bool:
        """Whether a force is indicated, but no more strongly than seen by chance."""
        if self.reached or self.implausible or self.short:
            return False
        return self.misfits[0].log_p > POLICY.adequacy_certain * self.threshold

    def judged(self, gain: float) -> Adequacy:
        """The same, after a test on held-out runs.

        A real force improves the prediction of held-out runs; a spurious one worsens it. For a
        force at the threshold, and a quarter of the runs held out, either error has a probability
        of about 8 %.

        Args:
            gain: in log likelihood of held-out runs by the force indicated.
        """
        if not self.slight or gain > 0.0:
            return self
        return replace(self, reached=True, refuted=gain)


def disturbance_at_limit(fit: Fit) -> tuple[str, ...]:
    """What of the fitted disturbance is at its limit: a misfit with another name."""
    return fit.problem.disturbance_at_limit(fit.noise)


def implausible_estimates(fit: Fit) -> tuple[Implausible, ...]:
    """Implausible estimates of causes: something similar acts instead.

    A coefficient is implausible more than ``implausible_prior_sd`` prior deviations off, or at its
    physical bound. Beside an effect ``extreme_prior_sd`` is enough: such a coefficient compensates
    for what the effect does not do; alone it may be an error in the parameter file. A coefficient
    that does the same as an effect may go as far as the effect.

    An effect is implausible with a sign that it cannot have, ``implausible_prior_sd`` times as
    strong as the strongest plausible one, or with a shape far from the plausible ones, or with one
    that nothing depends on.
    """
    effects_too = {Coefficient(p) for effect in fit.problem.known.values() for p in effect.equals}
    farthest = POLICY.extreme_prior_sd if fit.effects else POLICY.implausible_prior_sd
    judged = set(fit.released) - effects_too
    found = [
        Implausible(one, f"{one.path} {abs(z):.0f} {FAR}")
        for one, z in zip(fit.problem.baseline.ids, fit.point.z, strict=True)
        if one in judged and (abs(z) > farthest or one in fit.at_bounds)
    ]
    for name in fit.effects:
        for parameter in fit.problem.known[name].parameters:
            id = EffectParameterId(name, parameter.name)
            value, unit = fit.point.effects[id], parameter.unit
            beyond = (
                _out_of_place(parameter, value) or _is_lost(fit, id, parameter)
                if parameter.shapes
                else _beyond(parameter, fit.interval(id))
            )
            if beyond:
                words = f"{name} with a {parameter.name} of {value:.2g} {unit}"
                found.append(Implausible(EffectName(name), words))
    return tuple(found)


def contradicts_priors(fit: Fit) -> bool:
    """Whether the coefficients as a whole are further off than the vehicle described can be.

    Something is then missing that coefficients make up for, each within its bounds, or the vehicle
    is another one. The sum of squares of n coefficients in prior standard deviations is that of
    normal numbers, chi-squared with n degrees of freedom, or less where data hold little.
    """
    kept = np.array([one not in fit.released for one in fit.problem.baseline.ids])
    squares = float(np.sum(fit.point.z[kept] ** 2))
    return bool(chi2_log_tail(squares, int(kept.sum())) < np.log(POLICY.strange_coefficients))


def beyond_plausible(fit: Fit, name: str) -> bool:
    """Whether an interval of an effect's strength lies wholly outside its plausible range."""
    switching = fit.problem.known[name].switching
    return any(_beyond(p, fit.interval(EffectParameterId(name, p.name)), 1.0) for p in switching)


def _out_of_place(parameter: EffectParameter, value: float) -> bool:
    """Whether a shape is far from any plausible one, where the effect is a different one.

    A shape that does nothing where it is infinite, like the depth of a tank, is never too large.
    """
    low, high = parameter.plausible
    off = value - 0.5 * (low + high)
    if not np.isfinite(parameter.neutral):
        off = min(off, 0.0) if parameter.neutral > 0.0 else max(off, 0.0)
    return bool(abs(off) > POLICY.shape_reach * (high - low))


def _is_lost(fit: Fit, id: EffectParameterId, parameter: EffectParameter) -> bool:
    """Whether no residual depends on a shape of plausible size: the simulation diverges beside it.

    Such a fit has ended at the edge of where its model has a motion, and not at a minimum.
    """
    (low, high), value = parameter.plausible, fit.point.effects[id]
    return low <= value <= high and not fit.linearised.slopes[:, fit.ids.index(id)].any()


def _beyond(
    parameter: EffectParameter,
    interval: tuple[float, float],
    times: float = POLICY.implausible_prior_sd,
) -> bool:
    """Whether an interval lies wholly outside so many times what could be, seen from neutral."""
    neutral, (low, high) = parameter.neutral, parameter.plausible
    if not np.isfinite(neutral):  # such a limit is the stronger, the closer to zero it is
        return interval[1] < low / times if neutral > 0.0 else interval[0] > high / times
    below, above = min(low - neutral, 0.0), max(high - neutral, 0.0)
    return bool(interval[0] > neutral + times * above or interval[1] < neutral + times * below)


def adequacy(fit: Fit, rng: np.random.Generator) -> Adequacy:
    """Test a fit against forces of no particular origin.

    Args:
        fit: the explanation.
        rng: for the null distribution.
    """
    forces, signals = _indicated(fit)
    freedom = fit.problem.noise_freedom(fit)
    threshold = null_threshold([s for _, s in signals], rng, POLICY.adequacy_level, freedom)
    found = []
    for column, signal in signals:
        amount = float(signal.score[0] / signal.projected[0, 0] * forces.unit(column))
        found.append(Misfit(*forces.words(column), signal.log_p, amount))
    certain = POLICY.adequacy_certain * threshold
    if not any(m.log_p < certain for m in found):
        found += [m for m in _changing(fit, forces, signals) if m.log_p < certain]
    found.sort(key=lambda m: m.log_p)
    reached = not found or found[0].log_p >= threshold
    estimates = (one.words for one in implausible_estimates(fit))
    implausible = (*disturbance_at_limit(fit), *estimates)
    lack = fit.problem.lack_of_fit(fit)
    left = Adequacy(False, threshold, tuple(found[:8]), implausible, lack=lack)
    return replace(left, reached=reached and not implausible and not left.short)


def strongest_alarms(fit: Fit, rng: np.random.Generator) -> tuple[float, float, float]:
    """The smallest log p-value of a steady force and of a changing one: to calibrate by.

    With the threshold of the first in white residuals.
    """
    forces, signals = _indicated(fit)
    steady = min(signal.log_p for _, signal in signals)
    changing = min((m.log_p for m in _changing(fit, forces, signals)), default=0.0)
    only = [signal for _, signal in signals]
    return steady, changing, null_threshold(only, rng, POLICY.adequacy_level)


def _indicated(fit: Fit) -> tuple[GenericTerms, list[tuple[int, Signal]]]:
    """Generic forces along the fitted runs, and the test of each."""
    forces = fit.problem.generic_terms(fit)
    return forces, list(generic_signals(forces, Projector(fit)))


def _changing(
    fit: Fit, forces: GenericTerms, signals: Sequence[tuple[int, Signal]]
) -> list[Misfit]:
    """Generic forces each with a size of its own in every block of time.

    In white residuals what the sizes of n blocks explain is chi-squared with n degrees of freedom.
    None where no run is longer than a block, and none that swings with the drive: small errors of
    the drive have a size that follows its beat.

    Args:
        fit: the explanation.
        forces: along the fitted runs.
        signals: the test of each, with its column.
    """
    lin = fit.linearised
    if lin.time_of.max(initial=0.0) <= POLICY.long_score_block_s:
        return []
    blocks = block_index(lin.run_of, lin.time_of, POLICY.long_score_block_s)
    found = []
    for column, signal in signals:
        if forces.swings(column):
            continue
        left = signal.left[:, 0].astype(float)
        products = np.column_stack([-left * lin.residuals, left**2])
        score, info = sums_over(blocks, products).T
        shows = info > POLICY.smallest_signal
        if not shows.any():
            continue
        score, info = score[shows], info[shows]
        explained = float(np.sum(score**2 / info))
        # By noise alone the estimate of a size has the inverse of its information for a variance.
        square = max(explained - len(info), 0.0) / float(info.sum())
        amount = float(np.sqrt(square)) * forces.unit(column)
        log_p = float(chi2_log_tail(explained, len(info)))
        found.append(Misfit(*forces.words(column), log_p, amount, changing=True))
    return found


def generic_signals(forces: GenericTerms, projector: Projector) -> Iterator[tuple[int, Signal]]:
    """Each generic force by its column, as a cause that a refit follows as far as it can.

    Args:
        forces: the forces.
        projector: of the fit they are added to.
    """
    for first in range(0, len(forces.columns), SETTINGS_AT_ONCE):
        part = forces.columns[first : first + SETTINGS_AT_ONCE]
        each = [(NOTHING, 0, [i]) for i in range(len(part))]
        rows = projector.lin.whitened(forces.changes(part).T)
        signals = projector.signals(each, rows, count_prior=False)
        for column, signal in zip(part.tolist(), signals, strict=True):
            if signal is not None:
                yield column, signal
