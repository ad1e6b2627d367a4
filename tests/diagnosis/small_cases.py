"""Hidden cases small enough for the test suite: a few short runs of a fish with little to fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.hidden.cases import draw_truth, hidden_fish, write_case
from tests.hidden.plans import PLANS
from tests.hidden.truth import Truth


def small_case(
    folder: Path, effects: Mapping[str, float], runs: int = 4, duration: float = 12.0, seed: int = 0
) -> Truth:
    """Writes a dataset with the given strengths of effects hidden in it."""
    plan = replace(PLANS["rich"], runs=runs, duration=duration)
    streams = np.random.default_rng([7, seed]).spawn(5)
    truth = draw_truth("rich", seed, plan, effects, streams[0])
    fish, truth = hidden_fish(truth, plan, streams[1])
    return write_case(truth, fish, plan, folder, streams[2:])
