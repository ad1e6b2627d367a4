"""A cause beside a tail that beats out of step is found, with what puts the tail in step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import Dataset, load_dataset
from fish_env.identification import SeriesProblem
from fish_env.inference.drive import beside_drive
from fish_env.inference.effort import FULL
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.pipeline import refit_baseline
from fish_env.inference.probes import causes_of
from tests.diagnosis.small_cases import small_case

EFFORT = replace(FULL, finalists=2)


def beside(folder, effects):
    """What is found beside the drive, the baseline, and what is hidden."""
    truth = small_case(folder, effects, runs=2, duration=16.0)
    data = load_dataset(folder)
    assert isinstance(data, Dataset)
    nothing = Explanation((), refit_baseline(SeriesProblem(data)))
    causes, rng = causes_of(nothing.fit.problem), np.random.default_rng(0)
    steps: list[str] = []
    found = beside_drive(nothing, nothing, causes, rng, EFFORT, steps.append)
    return found, nothing, truth, steps


@pytest.mark.slow
@pytest.mark.long
def test_a_wake_is_found_beside_a_slow_beat(tmp_path):
    hidden = {"wake_memory": 1.0, "frequency_scale": 1.0}
    found, nothing, truth, _ = beside(tmp_path / "data", hidden)
    assert set(found.explanation.causes) == {*hidden}
    point = found.explanation.fit.point.effects
    for name, values in truth.effects.items():
        for parameter, value in values.items():
            assert point[EffectParameterId(name, parameter)] == pytest.approx(value, rel=0.2)
    noise = found.explanation.fit.noise
    assert not nothing.fit.problem.follows_drive(noise), "no phase is left to wander"


def test_a_tail_in_step_is_not_followed(tmp_path):
    found, _, _, steps = beside(tmp_path / "data", {})
    assert found is None
    assert steps == ["fitting with a random-walk phase of the drive"]
