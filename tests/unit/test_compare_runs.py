"""Comparison of runs over time: a simulation measured must come back as right."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fish_env.comparison import compare, compare_runs
from fish_env.comparison.errors import aligned, channel_error, plain
from fish_env.comparison.start import measured_start
from fish_env.comparison.words import in_words
from fish_env.data import CommandSteps, Dataset, Run, load_dataset
from fish_env.data.schema import Start
from fish_env.effects.extended import build_model
from fish_env.params import FishParams, load_fish
from fish_env.simulator import InitialState, Simulator
from tests.fixtures.measured_data import measured_runs

FISH = load_fish("zheng-2021-a")
COMMANDS = CommandSteps(np.array([0.0]), np.array([[0.3, 0.35, 2.0, 0.004, 0.1]]))
CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw")
TIMES = np.arange(0.0, 6.0, 0.05)


def measured(
    name: str = "r01",
    start: Start = "rest",
    initial: InitialState | None = None,
    phase: float | None = 0.0,
    channels: tuple[str, ...] = CHANNELS,
    fish: FishParams = FISH,
    condition: str | None = None,
) -> Run:
    """A run whose measurements are a simulation."""
    trajectory = Simulator(fish).run(COMMANDS, initial=initial, sample_times_s=TIMES)
    series = {channel: trajectory[channel].copy() for channel in channels}
    return Run(name, TIMES, series, COMMANDS, start, phase, condition)


def dataset(*runs: Run) -> Dataset:
    return Dataset("pool", "zheng-2021-a", runs)


def test_a_measured_simulation_is_matched_exactly() -> None:
    result = compare(dataset(measured()))
    run = result.runs[0]
    assert max(error.rmse for error in run.errors.values()) < 1e-9
    assert min(error.fit_percent for error in run.errors.values()) > 99.999
    assert run.path_error_m.max() < 1e-9
    assert "rest" in run.start_from


def test_another_fish_is_not_matched() -> None:
    slower = FISH.replace({"body.plane_xz.drag.c0": 0.3})
    run = compare(dataset(measured()), slower).runs[0]
    assert run.errors["x"].rmse > 1e-3
    assert run.errors["x"].fit_percent < 98.0


def test_an_unknown_phase_is_found() -> None:
    phase = 2 * np.pi * 5 / 16
    run = measured(initial=InitialState(tail_phase=phase), phase=None)
    result = compare_runs(dataset(run), FISH).runs[0]
    assert result.start.tail_phase == pytest.approx(phase)
    assert "best of 16" in result.start_from
    assert result.errors["yaw"].rmse < 1e-9


def test_an_unknown_start_is_taken_from_the_samples() -> None:
    initial = InitialState(
        (0.4, -0.2, 0.5), (0.0, 0.1, 2.5), (0.15, 0.0, 0.02), (0.0, 0.0, -0.2), tail_phase=1.0
    )
    start, words = measured_start(measured("r", "unknown", initial, 1.0), build_model(FISH))
    assert start.position == pytest.approx(initial.position)
    assert start.euler == pytest.approx(initial.euler)
    assert start.velocity_body == pytest.approx(initial.velocity_body, abs=0.04)
    # Over the beats the fish has turned into its new circle already.
    assert start.angular_velocity_body[2] == pytest.approx(-0.2, abs=0.15)
    assert "first two tail beats" in words


def test_a_steadily_turning_and_beating_yaw_has_its_mean_rate() -> None:
    yaw = 0.3 * TIMES + 0.1 * np.sin(4 * np.pi * TIMES + 0.7)
    run = Run("r", TIMES, {"yaw": yaw}, COMMANDS, "unknown", 0.0)
    start, _ = measured_start(run, build_model(FISH))
    assert start.angular_velocity_body[2] == pytest.approx(0.3)


def test_measured_velocities_are_used_where_there_are_some() -> None:
    initial = InitialState(velocity_body=(0.2, 0.03, -0.01), angular_velocity_body=(0.1, 0.2, 0.3))
    run = measured("r", "unknown", initial, 0.0, (*CHANNELS, "u", "v", "w", "p", "q", "r"))
    start, _ = measured_start(run, build_model(FISH))
    assert start.velocity_body == pytest.approx(initial.velocity_body)
    assert start.angular_velocity_body == pytest.approx(initial.angular_velocity_body)


def test_missing_samples_stay_out() -> None:
    run = measured()
    run.channels["x"][[0, 5, 6]] = np.nan
    result = compare(dataset(run)).runs[0]
    assert result.errors["x"].samples == len(TIMES) - 3
    assert np.isfinite(result.errors["x"].rmse)


def test_a_clock_effect_of_the_fish_is_honoured() -> None:
    clock = dataclasses.replace(FISH, effects={"clock_scale": {"scale": 1.02}})
    true = Simulator(FISH).run(COMMANDS, sample_times_s=1.02 * TIMES)
    run = Run("r", TIMES, {"x": true["x"], "yaw": true["yaw"]}, COMMANDS, "rest", 0.0)
    assert compare(dataset(run), clock).runs[0].errors["x"].rmse < 1e-9
    assert compare(dataset(run), FISH).runs[0].errors["x"].rmse > 1e-3


def test_errors_are_simulated_minus_measured() -> None:
    truth = np.array([0.0, 1.0, np.nan, 3.0])
    error = channel_error(truth, np.array([1.0, 2.0, 7.0, 4.0]))
    assert (error.samples, error.bias, error.mae, error.rmse) == (3, 1.0, 1.0, 1.0)
    assert channel_error(truth, truth).fit_percent == 100.0
    mean = np.full(4, 4.0 / 3.0)
    assert channel_error(truth, mean).fit_percent == pytest.approx(0.0)
    assert np.isnan(channel_error(np.ones(3), np.ones(3)).fit_percent)


def test_a_whole_turn_between_two_yaws_is_no_error_at_the_start_but_later() -> None:
    yaw = np.array([3.0, 3.1, -3.1, -3.0])
    truth, model = aligned("yaw", yaw, yaw + 2 * np.pi)
    np.testing.assert_allclose(truth, model)
    assert truth[-1] > 3.1
    wound = np.array([3.0, 5.0, 7.0, 9.3])
    truth, model = aligned("yaw", yaw, wound)
    assert model[-1] - truth[-1] == pytest.approx(9.3 - (2 * np.pi - 3.0))


def test_conditions_gather_repeats_and_words_name_the_worst() -> None:
    slower = FISH.replace({"body.plane_xz.drag.c0": 0.3})
    runs = (
        measured("a1", condition="A"),
        measured("a2", condition="A"),
        measured("b", fish=slower),
    )
    result = compare_runs(dataset(*runs), FISH)
    assert {name: len(group) for name, group in result.by_condition().items()} == {"A": 2, "b": 1}
    words = in_words(result)
    assert any(sentence.startswith("x:") and "largest in b" in sentence for sentence in words)
    numbers = result.as_dict()
    assert numbers["conditions"]["A"]["channels"]["x"]["rmse"] < 1e-9
    assert numbers["overall"]["runs"] == 3
    json.dumps(numbers, allow_nan=False)


def test_plain_values_fit_into_json() -> None:
    value = {"a": np.array([1.0, np.nan]), "b": (np.float64(np.inf), Path("x")), "c": np.int64(3)}
    assert plain(value) == {"a": [1.0, None], "b": [None, "x"], "c": 3}


@pytest.mark.measured
def test_the_measured_fish_is_compared_run_by_run() -> None:
    data = load_dataset(measured_runs())
    assert isinstance(data, Dataset)
    some = dataclasses.replace(data, runs=data.runs[:3])
    result = compare(some)
    assert [run.id for run in result.runs] == list(some.ids)
    assert all("best of 16" in run.start_from for run in result.runs)
    assert all(0.0 < run.path_error_m.max() < 1.0 for run in result.runs)
