"""Every number that decides about the recordings of a rigid vehicle, with its source."""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.inference.policy_numbers import BY_HAND, Numbers, number


@dataclass(frozen=True)
class RecordingPolicy(Numbers):
    """Thresholds of stuck sensors, jumps of clocks, noise, outliers and consistency.

    Attributes:
        fewest_stuck_samples: samples of one value in a row from which a sensor may be stuck; fewer
            may be coarse digits.
        stuck_level: probability by coarse digits alone below which such a row is a fault.
        coarse_digits: distinct values, as a share of all, below which digits hide the noise of a
            body at rest.
        least_leap: change into or out of a stuck value, in usual steps, from which a sensor is
            stuck; a vehicle that begins to move changes less.
        clock_gap: usual sample intervals from which a gap is looked at for a jump of the clock.
        clock_jump_fits_sd: standard errors within which motion goes on as if no time had passed.
        clock_jump_excludes_sd: standard errors of usual motion over a gap beyond which the vehicle
            could not have stood still.
        fewest_noise_samples: samples that a channel needs for any statement on its noise.
        declared_too_large: estimated over declared noise below which the declared cannot be right.
        declared_too_small: estimated over declared noise above which the declared cannot be right.
        white_lags: numbers of samples, from 1 on, over which a channel is compared with itself.
        silent_level: probability by white noise alone from which on no channel shows a motion.
        fewest_derived_samples: samples from which a channel can be recognised as derived.
        own_noise: share of its noise that an independent channel keeps, whatever filter of others
            is taken off it.
        fewest_interpolated_samples: samples with all neighbours that interpolation needs.
        outlier_gate_sd: standard deviations from which a sample is an outlier.
        jump_settles_samples: samples after a jump of a command in which a spike may be motion.
        jitter_bound_sd: standard errors above the estimated jitter that its upper bound lies.
        consistency_level: share of consistent data sets in which anything is called inconsistent.
        consistency_draws: number of draws for the p-values of consistency.
        fewest_consistency_windows: windows that a test of consistency needs.
        same_reading_sd: standard errors within which a reading at the start is what a found error
            makes of it.
        most_jerked: share of the increments of a run that may be left out because something jerks
            the body.
        fewest_compared_points: points that a window of a comparison needs.
    """

    fewest_stuck_samples: int = number(10, 3, 1000, BY_HAND)
    stuck_level: float = number(1e-6, 1e-12, 0.05, BY_HAND)
    coarse_digits: float = number(0.2, 0.0, 1.0, BY_HAND)
    least_leap: float = number(0.5, 0.0, 10.0, BY_HAND)
    clock_gap: float = number(5.0, 1.0, 100.0, BY_HAND)
    clock_jump_fits_sd: float = number(4.0, 1.0, 20.0, BY_HAND)
    clock_jump_excludes_sd: float = number(8.0, 1.0, 50.0, BY_HAND)
    fewest_noise_samples: int = number(12, 5, 1000, BY_HAND)
    declared_too_large: float = number(0.85, 0.1, 1.0, BY_HAND)
    declared_too_small: float = number(1.3, 1.0, 10.0, BY_HAND)
    white_lags: int = number(32, 2, 1000, f"a beat or more; {BY_HAND}")
    silent_level: float = number(0.01, 1e-6, 0.5, "share of noise that is searched")
    fewest_derived_samples: int = number(200, 20, 10_000, BY_HAND)
    own_noise: float = number(0.25, 0.0, 1.0, BY_HAND)
    fewest_interpolated_samples: int = number(60, 20, 1000, "ten for each weight and more")
    outlier_gate_sd: float = number(6.0, 3.0, 20.0, "one normal sample of 500 million")
    jump_settles_samples: float = number(2.5, 0.0, 100.0, BY_HAND)
    jitter_bound_sd: float = number(2.0, 0.0, 10.0, "97.5 % of normal estimates are below")
    consistency_level: float = number(0.01, 1e-4, 0.5, BY_HAND)
    consistency_draws: int = number(3999, 99, 100_000, f"smallest p-value 0.00025; {BY_HAND}")
    fewest_consistency_windows: int = number(8, 2, 100, BY_HAND)
    same_reading_sd: float = number(3.0, 1.0, 10.0, BY_HAND)
    most_jerked: float = number(0.3, 0.0, 1.0, BY_HAND)
    fewest_compared_points: int = number(8, 2, 1000, BY_HAND)


RECORDINGS = RecordingPolicy()
