"""Simulated against measured motion: how wrong a fish's model is, where, and by how much."""

from collections.abc import Callable
from pathlib import Path

from fish_env.comparison.errors import ChannelError
from fish_env.comparison.runs import RunComparison, RunsComparison, compare_runs
from fish_env.comparison.tables import ObservationComparison, SteadyComparison, compare_steady
from fish_env.data import Dataset, SteadyDataset
from fish_env.params import FishParams, as_fish

__all__ = [
    "ChannelError",
    "ObservationComparison",
    "RunComparison",
    "RunsComparison",
    "SteadyComparison",
    "compare",
    "compare_runs",
    "compare_steady",
]


def compare(
    dataset: Dataset | SteadyDataset,
    fish: FishParams | str | Path | None = None,
    dt: float = 0.01,
    trust_effects: bool = False,
    progress: Callable[[str], None] | None = None,
) -> RunsComparison | SteadyComparison:
    """Simulates what a dataset measured and compares the two.

    Args:
        dataset: Runs over time, or a table of steady motion.
        fish: Another fish than the one the dataset names.
        dt: Longest physics step, s.
        trust_effects: Run the effect files that the fish's file names, see `load_fish`.
        progress: Told the id of each run that was simulated.

    Raises:
        RoboticFishError: The fish is unknown, or its simulation is not possible.
    """
    chosen = as_fish(fish or dataset.fish, trust_effects)
    if isinstance(dataset, SteadyDataset):
        return compare_steady(dataset, chosen, dt)
    return compare_runs(dataset, chosen, dt, progress)
