"""Comparison of tables of steady motion."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fish_env.comparison import SteadyComparison, compare, compare_steady
from fish_env.comparison.words import in_words
from fish_env.data import SteadyDataset
from fish_env.params import load_fish
from fish_env.steady import steady_motion

FISH = load_fish("zheng-2021-a")
OFFSETS = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.5)
COMMANDS = np.array([[offset, 0.35, 2.0, 0.0, 0.0] for offset in OFFSETS])


@pytest.fixture(scope="module")
def table() -> SteadyDataset:
    """A table whose measurements are simulations; the last two rows are repeats."""
    motion = steady_motion(FISH, COMMANDS)
    names = ("surge_speed", "yaw_rate", "turn_radius")
    observations = {name: motion[name].copy() for name in names}
    observations["turn_radius"][2] = np.nan
    ids, conditions = tuple("abcdef"), (None, None, None, None, "E", "E")
    return SteadyDataset("pool", "zheng-2021-a", ids, conditions, COMMANDS, observations)


def changed(table: SteadyDataset, name: str, values: np.ndarray) -> SteadyDataset:
    return dataclasses.replace(table, observations={**table.observations, name: values})


def test_a_simulated_table_is_matched(table: SteadyDataset) -> None:
    result = compare(table)
    assert isinstance(result, SteadyComparison)
    assert not result.unsteady
    for observation in result.observations.values():
        assert observation.r_squared > 0.9999
        assert observation.gain == pytest.approx(1.0, abs=2e-3)
    assert result.observations["turn_radius"].rows == 5
    assert result.observations["yaw_rate"].percent_rows == 5  # straight ahead is near zero


def test_errors_are_simulated_minus_measured(table: SteadyDataset) -> None:
    faster = changed(table, "surge_speed", 2.0 * table.observations["surge_speed"])
    speed = compare_steady(faster, FISH).observations["surge_speed"]
    assert speed.gain == pytest.approx(0.5, rel=1e-2)
    assert speed.percent_error == pytest.approx(50.0, rel=1e-2)
    assert speed.bias == pytest.approx(-speed.mae)
    assert speed.r_squared < 0.0


def test_the_worst_condition_and_the_trend_are_found(table: SteadyDataset) -> None:
    shift = np.array([0.05, 0.02, 0.0, -0.02, -0.06, -0.08])
    wrong = changed(table, "yaw_rate", table.observations["yaw_rate"] - shift)
    result = compare_steady(wrong, FISH)
    condition, error, _, _ = result.worst("yaw_rate", 1)[0]
    assert condition == "E"
    assert error == pytest.approx(-0.07, abs=2e-3)
    trend = result.observations["yaw_rate"].trend
    assert trend is not None
    assert trend[0] == "tail_offset"
    assert trend[1] < -0.9
    assert result.observations["yaw_rate"].repeat_sd == pytest.approx(0.02 / np.sqrt(2), rel=1e-3)
    assert any("Largest error in E" in words for words in in_words(result))


def test_a_value_that_the_model_does_not_have_is_left_out_and_counted(
    table: SteadyDataset,
) -> None:
    radius = table.observations["turn_radius"].copy()
    radius[2] = 5.0  # the model swims straight here
    observation = compare_steady(changed(table, "turn_radius", radius), FISH).observations[
        "turn_radius"
    ]
    assert len(observation.measured) == 6
    assert np.isfinite(observation.mae)
    json.dumps(compare_steady(table, FISH).as_dict(), allow_nan=False)


def test_pictures_are_written(table: SteadyDataset, tmp_path: Path) -> None:
    from fish_env.plotting.comparison import draw_steady

    for path in draw_steady(compare_steady(table, FISH), tmp_path):
        assert path.stat().st_size > 10_000
        assert path.with_suffix(".pdf").is_file()
