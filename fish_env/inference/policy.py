"""Every number that decides an inference, with its source.

What the numbers of all policies have in common is in :mod:`fish_env.inference.policy_numbers`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from fish_env.inference.policy_numbers import AKAIKE, BY_HAND, EFFORT, FISHER, Numbers, number


@dataclass(frozen=True)
class DecisionPolicy(Numbers):
    """Thresholds of screening, search, adequacy, estimates and intervals, for any vehicle.

    Attributes:
        screen_level: share of data sets without a cause in which any cause passes the screening.
        null_draws: number of draws of the smallest p-value's distribution.
        fewest_settings_apart: settings of an effect that are tested together from which each is
            also tested alone.
        power: power at the smallest detectable sizes.
        evidence_doubt: difference of -2 log evidence below which explanations are rivals.
        linear_doubt: difference of -2 log likelihood by which a linear model may be off where a fit
            has yet to tell.
        disagreement: how often runs would agree on one of two explanations that predict alike.
        most_causes: largest number of causes in an explanation.
        shortlist: effects tried at each step.
        finalists: effects fitted in full, of those tried at each step.
        quick_shortlist: effects tried at each step in quick mode, and beside causes.
        quick_finalists: effects fitted in full in quick mode, and beside causes.
        quick_runs: largest number of runs that quick mode fits.
        quick_run_s: longest stretch of a run that quick mode fits (s).
        coefficients_per_effect: coefficients tried for each effect tried at a step; one at least.
        most_newly_shown: largest number of effects tried again that the misfit had hidden.
        few_runs: runs on which a fit is begun, or tried.
        coarse_fit_runs: runs of a coarse fit.
        most_settled_starts: starts of a coarse fit at which the runs' own starts are settled.
        worth_coarse_fit: statistic above which an effect is tried under relaxed noise.
        most_relaxed: largest number of effects tried under relaxed noise.
        coarse_fit_behind: share of the leader's gain that a finalist may lack.
        coarse_fit_leeway: difference of coarse fits in -2 log likelihood that excludes no cause.
        out_of_reach: distance to the leader beyond which a fit is stopped.
        most_passes: how often all runs are simulated before no further search begins.
        aic_penalty: expected gain of a coarse fit by a parameter without effect.
        largest_disturbance: strongest disturbance of the search, over the plausible limit.
        sure_sd: standard errors from neutral beyond which no fit without the cause is tried.
        pursuits: number of times that many causes are searched together.
        most_challenges: largest number of effects fitted in place of one found among many.
        most_single_searches: causes that are searched one at a time while a large misfit is
            unexplained, before many are searched together.
        most_lookalikes: confusable effects tried in place of each cause that is searched alone.
        most_substitutes: pairs of a cause and a substitute that are tried in coarse fits.
        most_turned_sizes: sizes of a substitute from which a coarse fit is tried in turn.
        most_echoes: confusable effects tried in place of the first cause picked.
        most_leads: best of these effects and the first pick that are fitted with all other picks.
        trial_steps: steps of a trial of an effect that a disturbance at its limit hides.
        most_close_trials: largest number of effects from trials that are fitted to all runs.
        most_beside_nominal: causes added to a nominal vehicle before a search from it is given up.
        halving: one of so many settings that were tried on one run is tried on more.
        swap_steps: steps of a fit with another lag, from one with the lag in whose place it is.
        rate_steps: most steps of a fit with another clock or beat, or none, in the place of one.
        least_independent_share: share of a signal that those picked before it must leave.
        least_learned_share: share of the prior variance of a coefficient that data must take away
            for a test of its prior.
        smallest_signal: least that a refit leaves of a signal that is tested, in squared noise
            units.
        smallest_change: least change of the residuals by a signal that is tested, in squared noise
            units.
        relaxed_log_p: added to the log p-value of a cause if the adequacy test fails.
        adequacy_level: share of adequate explanations that the adequacy test rejects.
        adequacy_certain: multiple of the threshold's log p-value that chance does not reach.
        force_pool: most indicated generic forces that are considered beside causes.
        most_forces: largest number of generic forces that together stand in for a cause.
        small_errors: share of effects that act a little.
        small_error: size of one, as a share of the largest plausible one.
        prior_reach_sd: prior standard deviations that a coefficient may move.
        extreme_prior_sd: prior standard deviations that are implausible beside an effect.
        implausible_prior_sd: prior standard deviations, or plausible sizes, that are implausible.
        strange_coefficients: p-value of all coefficients under their priors below which no cause is
            believed beside something unknown.
        most_owed_to_coefficients: share of an effect that it may owe to such coefficients.
        least_simulated_size: multiple of its estimate that simulation may ask for of a cause beside
            something unknown, at the upper end of the interval.
        most_simulated_size: the same at the lower end.
        shape_reach: distance from the middle of its plausible range, in lengths of that range,
            beyond which the shape of an effect is implausible.
        lifted_prior_precision: precision left to the prior of a coefficient that is a cause.
        most_blind_share: share of effects that the data cannot show, beyond which no misfit is
            ``not_excited``.
        far_start_sd: prior standard deviations beyond which a fit also starts from nominal values.
        score_block_s: length of blocks over which scores are summed (s).
        long_score_block_s: length of the longer blocks (s).
        converged: predicted decrease of -2 log likelihood at which a fit has converged.
        same_noise: relative change of the noise below which its alternation with the fit ends.
        run_variation_gain: gain in -2 log likelihood from which a spread over runs is used.
        most_variation_turns: largest number of turns between fitting what runs share and what they
            differ in.
        largest_run_spread: largest spread over runs, over the usual one, that is looked for.
        surely_negative_sd: standard errors of a run's number by which its mean is surely negative.
        shown_spread_level: share of data sets in which chance alone shows a spread over runs.
        most_untold_variance: share of a spread's variance that data leave open, from which the
            spread is not shown.
        jitter_gain: gain in -2 log likelihood from which jitter of the sample times is used.
        least_sensor_share: least noise of a sensor, over what quiet stretches of its samples show.
        noisier_than_declared: median ratio of found to declared noise that replaces the declared.
        fewest_runs_for_spread: smallest number of runs for a spread over runs.
        fewest_runs_for_interval: smallest number of runs for an interval over runs.
        interval_error: share of intervals and regions that do not hold the truth.
        run_errors_level: share of parameters whose interval runs widen by chance.
        beyond_usual: spread over runs, over the usual one, from which it is a finding.
        surprising_runs_level: p-value of what ordinary runs differ in, below which it does not take
            the place of a cause.
        visible_misfit: misfit over noise below which the error budget has no shares.
        smallest_gap: gap from baseline to noise below which no share of it is reported.
        largest_squared_error: largest squared error of a prediction, in noise units; a diverging
            model counts with it.
        least_share: share of the gap below which a named answer is called doubtful.
        least_named_share: share of the misfit that a cause named beside larger ones has in some
            channel, or that it takes away alone or last.
        prediction_window_s: length of predictions without feedback (s).
    """

    screen_level: float = number(0.05, 1e-4, 0.5, FISHER)
    null_draws: int = number(
        4000, 500, 100_000, "the 5 % quantile of 4000 draws is known to 0.3 points"
    )
    fewest_settings_apart: int = number(
        4, 1, 100, f"six together ask for a quarter more of each than one alone; {BY_HAND}"
    )
    power: float = number(0.8, 0.5, 0.99, "convention (Cohen, 1988)")
    evidence_doubt: float = number(
        6.0, 0.0, 20.0, "strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    linear_doubt: float = number(18.0, 0.0, 100.0, EFFORT)
    disagreement: float = number(0.05, 1e-4, 0.5, FISHER)
    most_causes: int = number(8, 1, 20, "specification of real robots: up to eight")
    shortlist: int = number(6, 1, 40, EFFORT)
    finalists: int = number(4, 1, 40, EFFORT)
    quick_shortlist: int = number(3, 1, 40, EFFORT)
    quick_finalists: int = number(1, 1, 40, EFFORT)
    quick_runs: int = number(2, 1, 100, EFFORT)
    quick_run_s: float = number(20.0, 1.0, 1e4, EFFORT)
    coefficients_per_effect: float = number(0.5, 0.0, 10.0, EFFORT)
    most_newly_shown: int = number(3, 0, 40, EFFORT)
    few_runs: int = number(3, 1, 100, EFFORT)
    coarse_fit_runs: int = number(2, 1, 100, EFFORT)
    most_settled_starts: int = number(12, 1, 1000, EFFORT)
    worth_coarse_fit: float = number(20.0, 0.0, 100.0, EFFORT)
    most_relaxed: int = number(4, 0, 40, EFFORT)
    coarse_fit_behind: float = number(0.25, 0.0, 1.0, EFFORT)
    coarse_fit_leeway: float = number(100.0, 0.0, 1e4, EFFORT)
    out_of_reach: float = number(1000.0, 0.0, 1e5, EFFORT)
    most_passes: float = number(
        10_000.0, 1.0, 1e12, "three times what eight runs of 30 s with one cause take"
    )
    aic_penalty: float = number(2.0, 0.0, 10.0, AKAIKE)
    sure_sd: float = number(10.0, 5.0, 100.0, EFFORT)
    pursuits: int = number(2, 0, 10, EFFORT)
    most_challenges: int = number(2, 0, 20, EFFORT)
    most_single_searches: int = number(3, 0, 20, EFFORT)
    most_lookalikes: int = number(4, 0, 40, EFFORT)
    most_substitutes: int = number(6, 0, 100, EFFORT)
    most_turned_sizes: int = number(6, 0, 100, EFFORT)
    most_echoes: int = number(3, 0, 40, EFFORT)
    most_leads: int = number(2, 1, 40, EFFORT)
    trial_steps: int = number(4, 1, 40, f"a lag that is right is found in three; {EFFORT}")
    most_close_trials: int = number(2, 1, 20, EFFORT)
    most_beside_nominal: int = number(2, 0, 20, EFFORT)
    halving: int = number(8, 1, 1000, EFFORT)
    swap_steps: int = number(4, 1, 40, EFFORT)
    rate_steps: int = number(10, 1, 40, f"a fit without a wrong rate settles in nine; {EFFORT}")
    least_independent_share: float = number(0.05, 0.0, 0.5, BY_HAND)
    least_learned_share: float = number(0.05, 0.0, 0.5, BY_HAND)
    smallest_signal: float = number(1e-4, 0.0, 1.0, BY_HAND)
    smallest_change: float = number(1e-3, 0.0, 1.0, BY_HAND)
    largest_disturbance: float = number(20.0, 1.0, 100.0, BY_HAND)
    relaxed_log_p: float = number(float(np.log(10.0)), 0.0, 10.0, BY_HAND)
    adequacy_level: float = number(0.003, 1e-4, 0.1, "scripts/calibrate_adequacy.py")
    adequacy_certain: float = number(
        2.0, 1.0, 10.0, "scripts/calibrate_adequacy.py: chance reached 1.23"
    )
    force_pool: int = number(16, 1, 1000, EFFORT)
    most_forces: int = number(8, 1, 100, EFFORT)
    small_errors: float = number(
        0.13, 0.0, 1.0, "specification of real robots: five to ten effects of the catalogue"
    )
    small_error: float = number(
        0.15, 0.0, 1.0, "specification of real robots: a tenth to a fifth of a usual size"
    )
    prior_reach_sd: float = number(5.0, 3.0, 12.0, BY_HAND)
    extreme_prior_sd: float = number(4.9, 3.0, 12.0, "one coefficient in a million passes it")
    implausible_prior_sd: float = number(10.0, 5.0, 50.0, BY_HAND)
    strange_coefficients: float = number(
        1e-4, 1e-12, 0.05, "the vehicle described is so in all but one of ten thousand cases"
    )
    most_owed_to_coefficients: float = number(
        0.1, 0.01, 1.0, "estimates are to be right within a tenth"
    )
    least_simulated_size: float = number(0.9, 0.5, 1.0, "estimates are to be right within a tenth")
    most_simulated_size: float = number(2.0, 1.0, 10.0, BY_HAND)
    shape_reach: float = number(1.5, 0.5, 20.0, BY_HAND)
    lifted_prior_precision: float = number(1e-4, 0.0, 0.1, BY_HAND)
    most_blind_share: float = number(0.5, 0.0, 1.0, BY_HAND)
    far_start_sd: float = number(2.0, 0.5, 5.0, EFFORT)
    score_block_s: float = number(3.0, 0.5, 30.0, BY_HAND)
    long_score_block_s: float = number(9.0, 1.0, 60.0, BY_HAND)
    converged: float = number(0.25, 1e-4, 1.0, "no estimate moves by half its standard error")
    same_noise: float = number(0.1, 0.01, 0.5, BY_HAND)
    run_variation_gain: float = number(
        6.0, 0.0, 30.0, "strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    most_variation_turns: int = number(2, 1, 20, EFFORT)
    largest_run_spread: float = number(30.0, 1.0, 1e3, BY_HAND)
    surely_negative_sd: float = number(2.0, 0.0, 10.0, BY_HAND)
    shown_spread_level: float = number(0.05, 1e-4, 0.5, FISHER)
    most_untold_variance: float = number(0.5, 0.0, 1.0, BY_HAND)
    jitter_gain: float = number(
        10.0, 0.0, 30.0, "very strong evidence: Kass and Raftery (1995), JASA 90, section 3.2"
    )
    least_sensor_share: float = number(0.1, 1e-3, 1.0, "scripts/calibrate_sensor_share.py")
    noisier_than_declared: float = number(1.1, 1.0, 2.0, "scripts/calibrate_declared_noise.py")
    fewest_runs_for_spread: int = number(3, 2, 10, "two degrees of freedom")
    fewest_runs_for_interval: int = number(3, 2, 10, "two degrees of freedom")
    interval_error: float = number(0.05, 1e-4, 0.5, FISHER)
    run_errors_level: float = number(0.05, 1e-4, 0.5, FISHER)
    beyond_usual: float = number(3.0, 1.0, 10.0, BY_HAND)
    surprising_runs_level: float = number(
        0.001, 1e-12, 0.5, f"predictions of runs are shrunk, so it is rarer by chance; {BY_HAND}"
    )
    visible_misfit: float = number(0.01, 0.0, 1.0, BY_HAND)
    smallest_gap: float = number(0.01, 0.0, 1.0, BY_HAND)
    largest_squared_error: float = number(
        1e4, 1.0, 1e8, f"a hundred standard deviations; {BY_HAND}"
    )
    least_share: float = number(0.1, 0.0, 0.5, "specification of real robots: a tenth of the gap")
    least_named_share: float = number(
        0.005, 0.0, 0.1, "calibrate_named_share.py: main effects at 0.6 of their size have 0.0066"
    )
    prediction_window_s: float = number(3.0, 0.5, 60.0, BY_HAND)

    @property
    def interval_level(self) -> float:
        """Share of intervals and regions that hold the truth."""
        return 1.0 - self.interval_error

    @property
    def interval_ends(self) -> tuple[float, float]:
        """Quantiles at the two ends of an interval."""
        return 0.5 * self.interval_error, 1.0 - 0.5 * self.interval_error

    @property
    def interval_reach(self) -> float:
        """Standard errors from a normal estimate to either end of its interval."""
        return float(ndtri(self.interval_ends[1]))


POLICY = DecisionPolicy()
