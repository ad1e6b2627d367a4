"""Check that runs can be diagnosed. Data that would mislead the search are refused by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data import load_dataset
from fish_env.data.clock import check_seconds
from fish_env.data.schema import Dataset, Run, identical_runs
from fish_env.diagnosis.policy import CHECKS
from fish_env.errors import DatasetError
from fish_env.identification.channels import body_channels, usable_channels
from fish_env.identification.recorded import recorded_run
from fish_env.identification.series import SeriesProblem
from fish_env.inference.hypotheses import short_name
from fish_env.inference.policy import POLICY
from fish_env.rigidbody.recording_faults import check_clock_jumps, check_stuck

_AMPLITUDE, _FREQUENCY = 1, 2


def load_runs(folder: str | Path) -> Dataset:
    """A dataset of runs over time.

    Raises:
        DatasetError: refused input, or a table of steady motion.
    """
    dataset = load_dataset(folder)
    if not isinstance(dataset, Dataset):
        raise DatasetError(
            f"{folder}: a table of steady motion; this needs runs over time, "
            "use `robofish compare` or `robofish diagnose` for tables"
        )
    return dataset


def divergence(problem: SeriesProblem) -> DatasetError:
    """What to tell the user when a fit goes where the simulation diverges."""
    return DatasetError(
        f"{problem.dataset.name}: the simulation diverges while {problem.fish.name} is fitted to "
        "these runs; check that fish, units and frame are those of the data"
    )


def check_runs(dataset: Dataset) -> None:
    """Refuse runs that no diagnosis should be built on.

    Raises:
        DatasetError: Names the run, the channel or the time, and what to change.
    """
    if not body_channels(dataset.channels):
        raise DatasetError(
            f"{dataset.name}: measures only {', '.join(dataset.channels)}; "
            "a diagnosis needs positions, angles or velocities of the body"
        )
    for first, second in identical_runs(dataset.runs):
        raise DatasetError(
            f"{dataset.name}: runs {first} and {second} have the same samples, unlike real "
            "repeats; remove one of them, because it would count twice"
        )
    check_seconds(dataset)
    for run in dataset.runs:
        _check_run(dataset.name, run)
    _check_amount(dataset)


def _check_run(name: str, run: Run) -> None:
    place, read = f"{name}: run {run.id}", recorded_run(run)
    _check_length(place, run)
    _check_clock(place, run)
    for channel, values in run.channels.items():
        present = values[np.isfinite(values)]
        if len(present) >= CHECKS.fewest_constant_samples and np.ptp(present) == 0.0:
            raise DatasetError(
                f"{place}: {channel} is {present[0]:g} in every sample, like a broken sensor; "
                "leave its cells empty in this run, or leave out the run"
            )
        check_stuck(place, read, channel)
    check_clock_jumps(place, read)


def _check_length(place: str, run: Run) -> None:
    frequency = run.commands.values[:, _FREQUENCY]
    beating = (run.commands.values[:, _AMPLITUDE] != 0.0) & (frequency > 0.0)
    beat = 1.0 / float(frequency[beating].max()) if beating.any() else 0.0
    lasts = float(run.time_s[-1] - run.time_s[0])
    if lasts < beat:
        raise DatasetError(
            f"{place}: lasts {lasts:.3g} s, less than one tail beat ({beat:.3g} s); leave it out, "
            "or give `time` a larger unit in dataset.yaml"
        )


def _check_clock(place: str, run: Run) -> None:
    gaps = np.diff(run.time_s)
    longest = int(np.argmax(gaps))
    if gaps[longest] > CHECKS.longest_gap_s:
        raise DatasetError(
            f"{place}: the clock jumps by {gaps[longest]:.4g} s at t = {run.time_s[longest]:.4g} s;"
            " times are in seconds: correct the clock, or split the run"
        )


def _check_amount(dataset: Dataset) -> None:
    for channel in usable_channels(dataset.channels):
        present = sum(int(np.isfinite(run.channels[channel]).sum()) for run in dataset.runs)
        if present < CHECKS.fewest_channel_samples:
            raise DatasetError(
                f"{dataset.name}: {present} samples of {channel} in all, too few for a "
                f"diagnosis; measure at least {CHECKS.fewest_channel_samples}"
            )


def doubts(answer: Mapping[str, Any]) -> list[str]:
    """Implausible numbers beside a verdict: signs that the fish file is of another fish.

    Data cannot tell that for sure. A wrong geometry comes out as coefficients far from what was
    known of them, a wrong mass as an added mass that is the same in every direction.

    Args:
        answer: the content of ``diagnosis.json``.
    """
    found = [_far_coefficients(answer["parameters"]), _mass_in_disguise(answer["causes"])]
    found += [f"The best fit is implausible: {s}." for s in answer.get("implausible", ())]
    return [doubt for doubt in found if doubt]


def _far_coefficients(parameters: Sequence[Mapping[str, Any]]) -> str:
    far = [p for p in parameters if abs(p["prior_sds_off"]) > POLICY.extreme_prior_sd]
    if not far:
        return ""
    far.sort(key=lambda p: -abs(p["prior_sds_off"]))
    named = ", ".join(f"{short_name(p['name'])} by {abs(p['prior_sds_off']):.0f}" for p in far[:3])
    return (
        "The refit moved coefficients much further than their priors allow, in standard deviations "
        f"{named}. Perhaps the parameter file is of another fish, or the fish was rebuilt: check "
        "`fish` in dataset.yaml, or give --fish."
    )


def _mass_in_disguise(causes: Sequence[Mapping[str, Any]]) -> str:
    added = next((c["parameters"] for c in causes if c["name"] == "added_mass"), None)
    if added is None:
        return ""
    lows, highs = zip(*(added[axis]["ci95"] for axis in ("surge", "sway", "heave")), strict=True)
    if max(lows) >= min(highs) or max(lows) <= 0.0:
        return ""
    return (
        f"The added mass, {max(lows):.2g} to {min(highs):.2g} kg, may be the same in every "
        "direction. A fish that is heavier by this mass would look the same: weigh it, and check "
        "mass.total and mass.buoyancy in its file."
    )
