"""Every number that decides how a fish is identified, with its source.

Those of inference, for any vehicle, are in :mod:`fish_env.inference.policy`.
"""

from __future__ import annotations

from dataclasses import dataclass

from fish_env.inference.policy_numbers import AKAIKE, BY_HAND, EFFORT, FISHER, Numbers, number

OWN_BEATS = "scripts/calibrate_own_beats.py"


@dataclass(frozen=True)
class IdentificationPolicy(Numbers):
    """Thresholds of beats, sensors, disturbances, tables and of fits with effects.

    Attributes:
        fewest_beats: beats that a stretch of constant commands must last for its beat to be
            measured.
        fewest_beat_samples: samples that a stretch of constant commands must have for its beat to
            be measured.
        lowest_beat_ratio: lowest beat looked for, over the commanded frequency.
        highest_beat_ratio: highest beat looked for, over the commanded frequency; twice it is the
            beat of surge and power.
        sway_level: p-value of a sway that is taken for the beat of the tail.
        uneven_beats: spread over runs of measured over commanded frequency from which runs beat
            differently.
        uneven_beats_level: p-value of the spread over runs from which runs beat differently.
        fewest_runs_for_beats: smallest number of runs for a comparison of their beats.
        least_beat_difference: relative difference of two beats that the starting grid cannot tell
            apart.
        clear_own_beat: share of what the common beat leaves that the own beat of one run takes
            away if runs differ.
        fewest_own_beats: number of runs with a noticeable own beat from which runs differ.
        noticeable_own_beat: share of what the common beat leaves that a noticeable own beat takes
            away.
        ordinary_mean_sd: standard errors of a mean over runs within which beats and sags are
            ordinary.
        ordinary_beat_error: share of the commanded frequency within which a servo is usually off.
        outlier_rounds: rounds in which samples far from their prediction are left out.
        unjudged_start_s: start of a run in which no sample is judged as an outlier (s).
        untold_start_s: start of a run from rest in which no sample judges anything (s): a late
            servo still follows what it was told before.
        smeared_gyro_s: time after a jump of a command in which no sample of a gyro judges anything
            (s), as the gyro may have a low-pass inside.
        enough_samples_per_s: samples a second that a fit uses, of more.
        samples_per_beat: samples that it uses in a beat, where that needs more.
        outliers_at_jumps_level: p-value of as many outliers near jumps of commands below which they
            are motion.
        copied_noise: root mean square by which the noise of two runs differs, over that of one,
            below which one is a copy of the other.
        fewest_noise_runs: runs that the noise is fitted to, at least.
        enough_noise_samples: samples of these, at least, where there are as many.
        least_noise_difference: relative standard deviation over runs of a sensor's noise below
            which all runs count as equally noisy.
        quiet_runs: quantile over runs whose noise is the usual one.
        largest_noise_scale: largest noise of a run over the usual one.
        told_noise_scale: noise of a run over the usual one from which it is told.
        fewest_declared_channels: channels with declared noise of which most can show more.
        told_outliers: share of the samples of a channel from which outliers are told in words.
        disturbance_weight: largest plausible disturbing force, over the weight of the fish.
        disturbance_arm: arm of the largest plausible disturbing moment, over the width of the hull.
        shortest_correlation_s: shortest plausible correlation time of a disturbance (s).
        longest_correlation_s: longest plausible correlation time of a disturbance (s).
        at_limit_share: share of the largest plausible disturbance, or correlation time, that counts
            as at the limit.
        felt_disturbance: share of the largest plausible disturbance below which no run tells how
            long it stays.
        least_phase_walk: smallest random walk of the tail's phase where runs beat differently
            (rad/s^0.5).
        largest_phase_walk: largest random walk of the tail's phase (rad/s^0.5); a larger one would
            hide what makes the tail late.
        least_jitter_s: smallest jitter of the sample times (s).
        largest_jitter_s: largest jitter of the sample times (s).
        slowest_steady_tail: beats that a tail makes, at least, in the time of a commanded one; a
            slower one is lost, and not steady.
        untold_change: change of all averages, in standard deviations of their noise, below which a
            table tells nothing of an effect.
        fewest_repeats: smallest number of repeats of conditions for a test of lack of fit.
        least_scatter: share of an average's spread below which its noise is not believed.
        most_added_effects: largest number of effects that a fit adds.
        most_judged_effects: effects of each step that are judged on groups left out.
        least_coarse_gain: decrease of -2 log likelihood that an effect needs to be judged.
        held_out_level: p-value, over groups, of a held-out gain for which an effect is added.
    """

    fewest_beats: float = number(6.0, 2.0, 100.0, BY_HAND)
    fewest_beat_samples: int = number(30, 10, 1000, BY_HAND)
    lowest_beat_ratio: float = number(0.75, 0.1, 1.0, BY_HAND)
    highest_beat_ratio: float = number(1.3, 1.0, 2.0, BY_HAND)
    sway_level: float = number(1e-6, 1e-12, 0.05, BY_HAND)
    uneven_beats: float = number(0.01, 0.0, 0.5, BY_HAND)
    uneven_beats_level: float = number(1e-4, 1e-12, 0.05, BY_HAND)
    fewest_runs_for_beats: int = number(3, 2, 20, BY_HAND)
    least_beat_difference: float = number(1.5e-3, 0.0, 0.1, BY_HAND)
    clear_own_beat: float = number(
        0.2, 0.0, 1.0, f"{OWN_BEATS}: one of 30 sets of runs with one beat has such a run"
    )
    fewest_own_beats: int = number(
        2, 1, 20, f"{OWN_BEATS}: sets of runs with one beat have one such run at most"
    )
    noticeable_own_beat: float = number(
        0.05, 0.0, 1.0, f"{OWN_BEATS}: all sets of runs that beat as servos do have two such runs"
    )
    ordinary_mean_sd: float = number(3.0, 1.0, 10.0, BY_HAND)
    ordinary_beat_error: float = number(4e-3, 0.0, 0.1, BY_HAND)
    outlier_rounds: int = number(
        4, 1, 20, f"an outlier turns the predictions after it, which hide others; {EFFORT}"
    )
    unjudged_start_s: float = number(0.6, 0.0, 10.0, BY_HAND)
    untold_start_s: float = number(0.15, 0.0, 5.0, BY_HAND)
    smeared_gyro_s: float = number(
        0.16,
        0.0,
        5.0,
        "0.14 s to a twentieth after a low-pass of 5 Hz, and 0.02 s by which clocks differ",
    )
    enough_samples_per_s: float = number(
        25.0, 1.0, 1e4, f"that of the data sets that levels were calibrated on; {EFFORT}"
    )
    samples_per_beat: float = number(8.0, 2.0, 100.0, EFFORT)
    outliers_at_jumps_level: float = number(0.01, 1e-6, 0.5, BY_HAND)
    copied_noise: float = number(
        0.5,
        0.0,
        1.4,
        f"sqrt(2) with noise of its own, 0 in a copy, and half is far from both; {BY_HAND}",
    )
    fewest_noise_runs: int = number(4, 1, 1000, EFFORT)
    enough_noise_samples: int = number(3000, 1, 10**6, EFFORT)
    least_noise_difference: float = number(
        0.2, 0.0, 1.0, "a weight that is off by a fifth loses 2 % of what a run tells"
    )
    quiet_runs: float = number(0.25, 0.0, 1.0, BY_HAND)
    largest_noise_scale: float = number(5.0, 1.0, 100.0, BY_HAND)
    told_noise_scale: float = number(1.5, 1.0, 10.0, BY_HAND)
    fewest_declared_channels: int = number(3, 1, 20, BY_HAND)
    told_outliers: float = number(1e-4, 0.0, 0.1, BY_HAND)
    disturbance_weight: float = number(
        1e-3, 1e-5, 0.1, f"20 mN for a fish of 2 kg, against 150 mN of thrust; {BY_HAND}"
    )
    disturbance_arm: float = number(0.25, 0.01, 1.0, BY_HAND)
    shortest_correlation_s: float = number(0.05, 0.01, 1.0, BY_HAND)
    longest_correlation_s: float = number(10.0, 1.0, 100.0, BY_HAND)
    at_limit_share: float = number(0.98, 0.5, 1.0, BY_HAND)
    felt_disturbance: float = number(0.1, 0.0, 1.0, BY_HAND)
    least_phase_walk: float = number(3e-3, 1e-4, 0.3, BY_HAND)
    largest_phase_walk: float = number(
        0.03, 1e-3, 0.3, f"own beat and sag leave some 0.15 rad after half a minute; {BY_HAND}"
    )
    least_jitter_s: float = number(2e-4, 0.0, 0.1, BY_HAND)
    largest_jitter_s: float = number(
        0.01, 0.0, 0.1, f"exposures of a camera jitter by a few milliseconds; {BY_HAND}"
    )
    slowest_steady_tail: float = number(0.1, 0.0, 1.0, BY_HAND)
    untold_change: float = number(0.01, 0.0, 1.0, BY_HAND)
    fewest_repeats: int = number(6, 2, 100, BY_HAND)
    least_scatter: float = number(1e-3, 1e-6, 0.1, BY_HAND)
    most_added_effects: int = number(6, 0, 40, EFFORT)
    most_judged_effects: int = number(2, 1, 40, EFFORT)
    least_coarse_gain: float = number(2.0, 0.0, 20.0, AKAIKE)
    held_out_level: float = number(0.05, 1e-4, 0.5, FISHER)


IDENTIFICATION = IdentificationPolicy()
