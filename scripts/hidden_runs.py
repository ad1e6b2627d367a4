"""Measured runs of a hidden case, for scripts that calibrate on such cases."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fish_env.data import load_dataset
from fish_env.data.schema import Dataset


def hidden_runs(make: Callable[[str, int, Path], Any], tier: str, seed: int) -> tuple[Any, Dataset]:
    """The truth of a case and its runs, of which no file stays.

    Args:
        make: ``make_case`` of a suite: tier, number and folder to the truth.
        tier: a tier that measures runs over time.
        seed: number of the case.
    """
    with tempfile.TemporaryDirectory() as place:
        truth = make(tier, seed, Path(place) / "data")
        dataset = load_dataset(Path(place) / "data")
    assert isinstance(dataset, Dataset)
    return truth, dataset
