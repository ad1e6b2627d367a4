"""Every number that decides an inference, with its source.

A number has a source, or was calibrated by a script of the project, or was set by hand, and says
which. ``docs/policy.md`` is made from this file, and every ``diagnosis.json`` holds the values that
it was made with.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

BY_HAND = "set by hand, not calibrated"
EFFORT = "limits effort; " + BY_HAND


def _number(value: float, low: float, high: float, source: str) -> Any:
    return field(default=value, metadata={"low": low, "high": high, "source": source})


@dataclass(frozen=True)
class DecisionPolicy:
    """Thresholds of screening, search, adequacy, estimates and intervals.

    Attributes:
        screen_level: share of data sets without a cause in which any cause passes the screening.
        null_draws: number of draws of the smallest p-value's distribution.
        power: power at the smallest detectable sizes.
        evidence_doubt: difference of -2 log evidence below which explanations are rivals.
        linear_doubt: difference of -2 log likelihood by which a linear model may be off where a fit
            has yet to tell.
        disagreement: how often runs would agree on one of two explanations that predict alike.
        most_causes: largest number of causes in an explanation.
        worth_coarse_fit: statistic above which an effect is tried under relaxed noise.
        most_relaxed: largest number of effects tried under relaxed noise.
        coarse_fit_behind: share of the leader's gain that a finalist may lack.
        coarse_fit_leeway: difference of coarse fits in -2 log likelihood that excludes no cause.
        out_of_reach: distance to the leader beyond which a fit is stopped.
        aic_penalty: expected gain of a coarse fit by a parameter without effect.
        largest_disturbance: strongest disturbance of the search, over the plausible limit.
        sure_sd: standard errors from neutral beyond which no fit without the cause is tried.
        pursuits: number of times that many causes are searched together.
        most_challenges: largest number of effects fitted in place of one found among many.
        relaxed_log_p: added to the log p-value of a cause if the adequacy test fails.
        adequacy_level: share of adequate explanations that the adequacy test rejects.
        adequacy_certain: multiple of the threshold's log p-value that chance does not reach.
        prior_reach_sd: prior standard deviations that a coefficient may move.
        extreme_prior_sd: prior standard deviations that are implausible beside an effect.
        implausible_prior_sd: prior standard deviations, or plausible sizes, that are implausible.
        strange_coefficients: p-value of all coefficients under their priors below which no cause is
            believed beside something unknown.
        far_start_sd: prior standard deviations beyond which a fit also starts from nominal values.
        score_block_s: length of blocks over which scores are summed (s).
        long_score_block_s: length of the longer blocks (s).
        converged: predicted decrease of -2 log likelihood at which a fit has converged.
        same_noise: relative change of the noise below which its alternation with the fit ends.
        run_variation_gain: gain in -2 log likelihood from which a spread over runs is used.
        jitter_gain: gain in -2 log likelihood from which jitter of the sample times is used.
        least_sensor_share: least noise of a sensor, over what quiet stretches of its samples show.
        noisier_than_declared: median ratio of found to declared noise that replaces the declared.
        fewest_runs_for_spread: smallest number of runs for a spread over runs.
        fewest_runs_for_interval: smallest number of runs for an interval over runs.
        run_errors_level: share of parameters whose interval runs widen by chance.
        beyond_usual: spread over runs, over the usual one, from which it is a finding.
        visible_misfit: misfit over noise below which the error budget has no shares.
        smallest_gap: gap from baseline to noise below which no share of it is reported.
        least_share: share of the gap below which a named answer is called doubtful.
        prediction_window_s: length of predictions without feedback (s).
    """

    screen_level: float = _number(0.05, 1e-4, 0.5, "convention (Fisher, 1925)")
    null_draws: int = _number(
        4000, 500, 100_000, "the 5 % quantile of 4000 draws is known to 0.3 points"
    )
    power: float = _number(0.8, 0.5, 0.99, "convention (Cohen, 1988)")
    evidence_doubt: float = _number(
        6.0, 0.0, 20.0, "strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    linear_doubt: float = _number(18.0, 0.0, 100.0, EFFORT)
    disagreement: float = _number(0.05, 1e-4, 0.5, "convention (Fisher, 1925)")
    most_causes: int = _number(8, 1, 20, "specification of real robots: up to eight")
    worth_coarse_fit: float = _number(20.0, 0.0, 100.0, EFFORT)
    most_relaxed: int = _number(4, 0, 40, EFFORT)
    coarse_fit_behind: float = _number(0.25, 0.0, 1.0, EFFORT)
    coarse_fit_leeway: float = _number(100.0, 0.0, 1e4, EFFORT)
    out_of_reach: float = _number(1000.0, 0.0, 1e5, EFFORT)
    aic_penalty: float = _number(2.0, 0.0, 10.0, "Akaike (1974), IEEE TAC 19")
    sure_sd: float = _number(10.0, 5.0, 100.0, EFFORT)
    pursuits: int = _number(2, 0, 10, EFFORT)
    most_challenges: int = _number(2, 0, 20, EFFORT)
    largest_disturbance: float = _number(20.0, 1.0, 100.0, BY_HAND)
    relaxed_log_p: float = _number(float(np.log(10.0)), 0.0, 10.0, BY_HAND)
    adequacy_level: float = _number(0.003, 1e-4, 0.1, "scripts/calibrate_adequacy.py")
    adequacy_certain: float = _number(2.0, 1.0, 10.0, "scripts/calibrate_adequacy.py: 1.0 at most")
    prior_reach_sd: float = _number(5.0, 3.0, 12.0, BY_HAND)
    extreme_prior_sd: float = _number(4.9, 3.0, 12.0, "one coefficient in a million passes it")
    implausible_prior_sd: float = _number(10.0, 5.0, 50.0, BY_HAND)
    strange_coefficients: float = _number(
        1e-4, 1e-12, 0.05, "the vehicle described is so in all but one of ten thousand cases"
    )
    far_start_sd: float = _number(2.0, 0.5, 5.0, EFFORT)
    score_block_s: float = _number(3.0, 0.5, 30.0, BY_HAND)
    long_score_block_s: float = _number(9.0, 1.0, 60.0, BY_HAND)
    converged: float = _number(0.25, 1e-4, 1.0, "no estimate moves by half its standard error")
    same_noise: float = _number(0.1, 0.01, 0.5, BY_HAND)
    run_variation_gain: float = _number(
        6.0, 0.0, 30.0, "strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    jitter_gain: float = _number(
        10.0, 0.0, 30.0, "very strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    least_sensor_share: float = _number(0.1, 1e-3, 1.0, "scripts/calibrate_sensor_share.py")
    noisier_than_declared: float = _number(1.1, 1.0, 2.0, "scripts/calibrate_declared_noise.py")
    fewest_runs_for_spread: int = _number(3, 2, 10, "two degrees of freedom")
    fewest_runs_for_interval: int = _number(3, 2, 10, "two degrees of freedom")
    run_errors_level: float = _number(0.05, 1e-4, 0.5, "convention (Fisher, 1925)")
    beyond_usual: float = _number(3.0, 1.0, 10.0, BY_HAND)
    visible_misfit: float = _number(0.01, 0.0, 1.0, BY_HAND)
    smallest_gap: float = _number(0.01, 0.0, 1.0, BY_HAND)
    least_share: float = _number(0.1, 0.0, 0.5, "specification of real robots: a tenth of the gap")
    prediction_window_s: float = _number(3.0, 0.5, 60.0, BY_HAND)

    def __post_init__(self) -> None:
        """Refuse values out of range.

        Raises:
            ValueError: names the number and its range.
        """
        for item in fields(self):
            value, low, high = getattr(self, item.name), item.metadata["low"], item.metadata["high"]
            if not low <= value <= high:
                raise ValueError(f"policy {item.name}: choose a value from {low} to {high}")

    def as_dict(self) -> dict[str, float]:
        """Name -> value, as written into ``diagnosis.json``."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def table(self) -> list[tuple[str, float, str]]:
        """Name, value and source of each number, for the documentation."""
        return [(i.name, getattr(self, i.name), i.metadata["source"]) for i in fields(self)]


POLICY = DecisionPolicy()
