"""Every number that decides about inputs and answers of a diagnosis, with its source.

Those of inference and of recordings, for any vehicle, are in :mod:`fish_env.inference.policy` and
:mod:`fish_env.rigidbody.policy`, and those of identification in
:mod:`fish_env.identification.policy`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fish_env.identification.policy import IDENTIFICATION
from fish_env.inference.policy import POLICY
from fish_env.inference.policy_numbers import BY_HAND, EFFORT, FISHER, Numbers, number
from fish_env.rigidbody.policy import RECORDINGS

COUNTED = f"{BY_HAND}; scripts/calibrate_inputs.py counts false alarms"


@dataclass(frozen=True)
class ChecksPolicy(Numbers):
    """Thresholds of checks of the inputs, held-out data, residuals and next experiments.

    Attributes:
        longest_gap_s: longest gap between samples of a run (s).
        fewest_channel_samples: smallest number of samples of a channel in all runs.
        fewest_constant_samples: samples of one value from which a channel counts as broken.
        suspicious_disagreement: disagreement of a comparison (0 the same, 1 unrelated, 2 opposite)
            from which its columns are read otherwise.
        least_fall: least fall of the disagreement by a decisive mistake, once it is put right.
        most_left: share of the disagreement that a decisive mistake, once put right, may leave;
            where the fish file is wrong by a factor of two, a wrong unit leaves more.
        input_fault_level: probability by chance below which a mistake is decisive.
        rival_reading: log likelihood within which another reading explains as much.
        clocks_tried: distinct rates and offsets of clocks that a search may end at.
        most_input_faults: largest number of mistakes that are looked for, one after the other.
        best_disagreement: disagreement below which a comparison cannot get better.
        comparison_weight: what a window of a comparison counts, as several comparisons are made of
            the same motion.
        way_by_noise_level: probability that noise alone makes a displacement from which a speed is
            taken.
        compared_from_s: start of a run in motion that is not compared with a simulation (s).
        servo_beat_error: share of the commanded frequency within which a servo may be off; beyond,
            a command or a clock is wrong.
        clear_sway: share of the sway that a beat explains if it is the tail's.
        far_peak: relative distance from the median beyond which the beat of a window is left out.
        clock_likeness: correlation from which a ratio of an angle's and a rate's increments is one
            of clocks.
        gross_clock: logarithm of a ratio of angles to rates that no gain of a gyro makes.
        alike_beats: relative spread of ratios within which runs are taken to beat alike.
        largest_clock_offset_s: largest offset between two clocks that is looked for (s).
        runs_for_rates: runs on which every rate of the commands' clock is tried.
        promising_rates: rates of the commands' clock that are then tried on all runs.
        rates_refined: the best of these, apart from each other, between which the beat decides.
        fewest_command_changes: changes of commands in a run that tell when they came.
        least_skew_gain: fall of the mean log of what the beat leaves for which a skew is tried.
        smallest_ratio_error: distance from one from which a ratio of beats or clocks is not one.
        sure_ratio_sd: standard errors from which a ratio of beats is not one.
        ratio_bias: what the ratio of beats is off by in good data.
        uneven_ratios: spread over runs of ratios of beats from which runs differ.
        uneven_ratios_level: p-value of the spread over runs of ratios of beats from which runs
            differ.
        one_clock_sd: standard errors from which a beat and a scale of angles are not one clock.
        clock_evidence: log likelihood by which the times of commands tell one clock from two.
        drive_law_level: p-value of a term of a law of the beat.
        certain_law_level: p-value of a law of the beat that is believed without a model of forces.
        far_window_sd: robust standard deviations beyond which the beat of a window is left out of a
            law of the beat.
        fewest_for_held_out: smallest number of runs, or conditions of runs, of which some are held
            out.
        held_out_runs: share of the runs that is held out.
        fewest_conditions: smallest number of conditions of a table.
        fewest_for_held_out_conditions: conditions of a table from which some are held out.
        held_out_conditions: share of the conditions that is held out.
        regime_level: p-value, over the whole table of regimes, of a place where misfit sits.
        regime_draws: number of shuffles for the p-values of regimes.
        fewest_regime_samples: samples from which a regime is judged.
        residual_pool: most indicated wrenches that the model of the residual is chosen from.
        most_residual_terms: largest number of terms of the model of the residual.
        least_residual_share: share of a wrench that terms chosen before it must leave.
        residual_rounds: largest number of rounds of choosing and fitting the model of the residual.
        residual_rounds_beside: the same beside causes, or where runs differ.
        shown_separation: squared distance, in noise units, that a manoeuvre must make between an
            effect and the present explanation.
        held_repeats: repeats of a proposed condition of a table.
        least_separation: squared distance, in noise units, that all repeats of a proposed condition
            must make together.
    """

    longest_gap_s: float = number(
        5.0, 0.1, 60.0, f"a motion carried further says nothing about the fish; {BY_HAND}"
    )
    fewest_channel_samples: int = number(50, 10, 10_000, BY_HAND)
    fewest_constant_samples: int = number(10, 3, 1000, BY_HAND)
    suspicious_disagreement: float = number(0.4, 0.0, 2.0, COUNTED)
    least_fall: float = number(
        0.2, 0.0, 2.0, f"a wrong sign makes it 2, a wrong unit 1, none 0; {COUNTED}"
    )
    most_left: float = number(0.5, 0.0, 1.0, COUNTED)
    input_fault_level: float = number(0.01, 1e-6, 0.5, COUNTED)
    rival_reading: float = number(8.0, 0.0, 50.0, COUNTED)
    clocks_tried: int = number(500, 1, 100_000, BY_HAND)
    most_input_faults: int = number(6, 1, 40, EFFORT)
    best_disagreement: float = number(0.02, 1e-4, 0.5, COUNTED)
    comparison_weight: float = number(0.5, 0.01, 1.0, COUNTED)
    way_by_noise_level: float = number(1e-3, 1e-9, 0.5, BY_HAND)
    compared_from_s: float = number(3.0, 0.0, 60.0, BY_HAND)
    servo_beat_error: float = number(
        0.15, 0.0, 0.5, f"runs of a real robot differ as much; {BY_HAND}"
    )
    clear_sway: float = number(0.5, 0.1, 0.99, f"it is above 0.8 in good data; {BY_HAND}")
    far_peak: float = number(0.03, 0.0, 0.5, BY_HAND)
    clock_likeness: float = number(0.9, 0.0, 1.0, BY_HAND)
    gross_clock: float = number(0.1, 0.0, 1.0, BY_HAND)
    alike_beats: float = number(0.02, 0.0, 0.5, BY_HAND)
    largest_clock_offset_s: float = number(5.0, 0.0, 60.0, EFFORT)
    runs_for_rates: int = number(3, 1, 100, EFFORT)
    promising_rates: int = number(20, 1, 230, EFFORT)
    rates_refined: int = number(3, 1, 20, EFFORT)
    fewest_command_changes: int = number(3, 1, 100, BY_HAND)
    least_skew_gain: float = number(0.1, 0.0, 5.0, BY_HAND)
    smallest_ratio_error: float = number(0.004, 0.0, 0.1, COUNTED)
    sure_ratio_sd: float = number(5.0, 1.0, 20.0, COUNTED)
    ratio_bias: float = number(0.001, 0.0, 0.1, f"the hull answers quicker beats later; {BY_HAND}")
    uneven_ratios: float = number(0.01, 0.0, 0.5, COUNTED)
    uneven_ratios_level: float = number(1e-5, 1e-12, 0.05, COUNTED)
    one_clock_sd: float = number(3.0, 1.0, 20.0, COUNTED)
    clock_evidence: float = number(5.0, 0.0, 50.0, COUNTED)
    drive_law_level: float = number(
        0.05, 1e-4, 0.5, f"{FISHER}; a term only begins a fit, whose evidence decides"
    )
    certain_law_level: float = number(
        1e-3,
        1e-9,
        0.05,
        "one law in a thousand by chance; tests/diagnosis/test_drive_law.py",
    )
    far_window_sd: float = number(3.5, 1.0, 20.0, BY_HAND)
    fewest_for_held_out: int = number(4, 2, 100, BY_HAND)
    held_out_runs: float = number(0.25, 0.0, 0.9, BY_HAND)
    fewest_conditions: int = number(3, 2, 100, BY_HAND)
    fewest_for_held_out_conditions: int = number(6, 2, 100, BY_HAND)
    held_out_conditions: float = number(0.2, 0.0, 0.9, BY_HAND)
    regime_level: float = number(0.05, 1e-4, 0.5, FISHER)
    regime_draws: int = number(499, 99, 100_000, f"smallest p-value 0.002; {EFFORT}")
    fewest_regime_samples: int = number(20, 1, 1000, BY_HAND)
    residual_pool: int = number(32, 1, 1000, EFFORT)
    most_residual_terms: int = number(8, 1, 40, BY_HAND)
    least_residual_share: float = number(1e-3, 0.0, 0.5, BY_HAND)
    residual_rounds: int = number(4, 1, 20, EFFORT)
    residual_rounds_beside: int = number(1, 1, 20, f"these rounds take longest; {EFFORT}")
    shown_separation: float = number(25.0, 0.0, 1e4, f"five standard deviations; {BY_HAND}")
    held_repeats: int = number(4, 1, 100, BY_HAND)
    least_separation: float = number(1.0, 0.0, 1e4, f"one standard deviation; {BY_HAND}")


CHECKS = ChecksPolicy()
POLICIES: Mapping[str, Numbers] = {
    "inference": POLICY,
    "recordings": RECORDINGS,
    "identification": IDENTIFICATION,
    "checks": CHECKS,
}
"""All policies of a diagnosis; no two of their numbers have one name."""


def policies_as_dict() -> dict[str, float]:
    """Name -> value of the numbers of all policies, as written into ``diagnosis.json``."""
    return {name: value for one in POLICIES.values() for name, value in one.as_dict().items()}
