"""What the sensors of a fish do to its record: outliers, and how noisy they may be at most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Dataset
from fish_env.identification.noise import white_noise_sd
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.recorded import recorded
from fish_env.inference.policy import POLICY
from fish_env.rigidbody.outliers import Outliers, outliers_of
from fish_env.rigidbody.sample_times import largest_jitter_s


def without_outliers(dataset: Dataset) -> tuple[Dataset, tuple[Outliers, ...]]:
    """A dataset whose outliers are missing samples, and what was left out by channel.

    Args:
        dataset: measured runs.
    """
    found = outliers_of(recorded(dataset))
    if not any(one.count for one in found):
        return dataset, found
    runs = tuple(
        replace(
            run,
            channels={
                one.channel: np.where(one.flagged[i], np.nan, run.channels[one.channel])
                for one in found
            },
        )
        for i, run in enumerate(dataset.runs)
    )
    return replace(dataset, runs=runs, notes=(*dataset.notes, *sentences(found))), found


def with_noise_shown(dataset: Dataset) -> Dataset:
    """The dataset with the noise that its samples show where that is more than it declares.

    Noise is often declared as of a robot at rest, and sensors are noisier while it moves. A motion
    that is not smooth looks like noise too, so most channels have to show it.

    Args:
        dataset: measured runs.
    """
    shown = noise_shown(dataset)
    times = _over_declared(dataset, shown)
    if times <= POLICY.noisier_than_declared:
        return dataset
    larger = {name: max(sd, shown[name]) for name, sd in dataset.noise.items()}
    said = (
        f"Samples scatter by about {times:.2g} times the noise that dataset.yaml declares. The "
        "scatter counts as noise; give the noise of sensors while the fish moves."
    )
    return replace(dataset, noise=larger, notes=(*dataset.notes, said))


def noise_over_declared(dataset: Dataset) -> float:
    """Median over channels of the noise that samples show over the declared; 0 of few channels."""
    return _over_declared(dataset, noise_shown(dataset))


def _over_declared(dataset: Dataset, shown: dict[str, float]) -> float:
    if len(dataset.noise) < IDENTIFICATION.fewest_declared_channels:
        return 0.0
    return float(np.median([shown[name] / sd for name, sd in dataset.noise.items()]))


def noise_shown(dataset: Dataset) -> dict[str, float]:
    """White noise by declared channel (SI): what quiet stretches and neighbours both allow."""
    found = {one.channel: one.noise_sd or np.inf for one in outliers_of(recorded(dataset))}
    return {n: min(white_noise_sd(dataset, n), found.get(n, np.inf)) for n in dataset.noise}


def largest_noise(dataset: Dataset, channels: tuple[str, ...], least: FloatArray) -> FloatArray:
    """(C,) what neighbours do not predict of each channel: its white noise is at most this, SI.

    A sensor may be noisier while the fish moves than in quiet stretches, or its clock may jitter.

    Args:
        dataset: measured runs.
        channels: channels (C,).
        least: (C,) what quiet stretches show, SI.
    """
    found = {one.channel: one.noise_sd for one in outliers_of(recorded(dataset))}
    return np.maximum(least, [found[name] or 0.0 for name in channels])


def largest_jitter_of(dataset: Dataset) -> float:
    """Largest jitter of the sample times that the channels allow (s)."""
    return largest_jitter_s(recorded(dataset))


def sentences(found: tuple[Outliers, ...]) -> list[str]:
    """What a reader should know about outliers."""
    many = [one for one in found if one.share > IDENTIFICATION.told_outliers]
    if not many:
        return []
    said = ", ".join(f"{one.channel} {one.count} ({100.0 * one.share:.2g} %)" for one in many)
    return [
        f"Samples far off those beside them were left out as outliers: {said}. They enter no "
        "fit and no score."
    ]
