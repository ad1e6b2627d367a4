"""Are these runs fit to be diagnosed? What would mislead the search is refused, with its name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.data.schema import Dataset, Run, identical_runs
from fish_env.diagnosis.conventions import check_conventions
from fish_env.diagnosis.records import check_clock_jumps, check_stuck
from fish_env.errors import DatasetError
from fish_env.identification.runs import usable_channels

LONGEST_GAP_S = 5.0
"""A motion carried further than this without a sample says nothing about the fish."""
FEWEST_SAMPLES = 50
_AMPLITUDE, _FREQUENCY = 1, 2


def check_runs(dataset: Dataset) -> None:
    """Refuse runs that no diagnosis should be built on.

    Raises:
        DatasetError: Names the run, the channel or the time, and what to change.
    """
    if not usable_channels(dataset.channels):
        raise DatasetError(
            f"{dataset.name}: measures only {', '.join(dataset.channels)}; "
            "a diagnosis needs positions, angles or velocities of the body"
        )
    for first, second in identical_runs(dataset.runs):
        raise DatasetError(
            f"{dataset.name}: runs {first} and {second} have the same samples, which repeats never "
            "have; remove one, it would count twice"
        )
    for run in dataset.runs:
        _check_run(dataset.name, run)
    _check_amount(dataset)
    check_conventions(dataset)


def _check_run(name: str, run: Run) -> None:
    place = f"{name}: run {run.id}"
    _check_length(place, run)
    _check_clock(place, run)
    for channel, values in run.channels.items():
        present = values[np.isfinite(values)]
        if len(present) >= 10 and np.ptp(present) == 0.0:
            raise DatasetError(
                f"{place}: {channel} is {present[0]:g} in every sample, no sensor is that still; "
                "leave its cells empty in this run, or leave out the run"
            )
        check_stuck(place, run, channel)
    check_clock_jumps(place, run)


def _check_length(place: str, run: Run) -> None:
    frequency = run.commands.values[:, _FREQUENCY]
    beating = (run.commands.values[:, _AMPLITUDE] != 0.0) & (frequency > 0.0)
    beat = 1.0 / float(frequency[beating].max()) if beating.any() else 0.0
    lasts = float(run.time_s[-1] - run.time_s[0])
    if lasts < beat:
        raise DatasetError(
            f"{place}: lasts {lasts:.3g} s, less than one tail beat ({beat:.3g} s); leave it out"
        )


def _check_clock(place: str, run: Run) -> None:
    gaps = np.diff(run.time_s)
    longest = int(np.argmax(gaps))
    if gaps[longest] > LONGEST_GAP_S:
        raise DatasetError(
            f"{place}: the clock jumps by {gaps[longest]:.4g} s at t = {run.time_s[longest]:.4g} s;"
            " correct it, or make two runs of it"
        )


def _check_amount(dataset: Dataset) -> None:
    for channel in usable_channels(dataset.channels):
        present = sum(int(np.isfinite(run.channels[channel]).sum()) for run in dataset.runs)
        if present < FEWEST_SAMPLES:
            raise DatasetError(
                f"{dataset.name}: {present} samples of {channel} in all, too few to judge anything "
                f"by; measure at least {FEWEST_SAMPLES}"
            )


ASTONISHING, MANY = 6.0, 4.0
"""Prior standard deviations that one coefficient, and the root mean square of all, may move."""


def another_fish(prior_sds_off: Sequence[float]) -> str | None:
    """A doubt to voice where a refit moved the coefficients further than the priors allow.

    Data cannot tell for sure that the parameter file is of another fish: a wrong mass or size
    comes out as coefficients that are all off at once.

    Args:
        prior_sds_off: how far each refitted coefficient is from its nominal value, in standard
            deviations of its prior.
    """
    off = np.abs(np.asarray(prior_sds_off, dtype=np.float64))
    far = int(np.sum(off > ASTONISHING))
    if not off.size or (far < 2 and np.sqrt(np.mean(off**2)) < MANY):
        return None
    return (
        f"The refit moved coefficients by up to {off.max():.0f} prior standard deviations "
        f"({far} by more than {ASTONISHING:.0f}). Perhaps the parameter file is of another fish, "
        "or mass, size or block were changed since: check `fish` in dataset.yaml, or give --fish."
    )
