"""The tail's frequency by the swaying of the hull, whatever the commands say."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.pipeline import diagnose
from fish_env.errors import DatasetError
from fish_env.identification.beats import (
    beats_of,
    by_run,
    frequency_of,
    uneven,
    with_measured_beats,
)
from fish_env.params import load_fish
from fish_env.simulator import Simulator

RATE, LENGTH = 13.0, 20.0


def sway(rng, frequency, noise, times):
    """A hull that turns ever faster and sways."""
    turn = 0.3 * times + 0.02 * times**2 + 0.4 * np.sin(0.1 * times)
    wave = 0.05 * np.sin(2 * np.pi * frequency * times + rng.uniform(0, 6))
    return turn + wave + noise * rng.standard_normal(len(times))


def run_of(name, rng, ratio, commanded=1.0, noise=0.005, channel="yaw"):
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    commands = CommandSteps([0.0], [[0.0, 0.4, commanded, 0.0, 0.0]])
    values = sway(rng, ratio * commanded, noise, times)
    return Run(name, times, {channel: values}, commands, "unknown")


def dataset_of(runs):
    return Dataset("swaying", "zheng-2021-a", tuple(runs))


def test_the_error_of_a_frequency_is_what_it_says():
    rng, off = np.random.default_rng(0), []
    for _ in range(300):
        times = np.sort(rng.uniform(0.0, LENGTH, 260))
        truth = rng.uniform(0.9, 1.1)
        found, sd = frequency_of(times, sway(rng, truth, 0.02, times), 1.0)
        off.append((found - truth) / sd)
    assert 0.85 < np.std(off) < 1.2
    assert abs(np.mean(off)) < 0.2


def test_no_frequency_is_read_out_of_noise():
    rng = np.random.default_rng(1)
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    assert all(frequency_of(times, rng.standard_normal(len(times)), 1.0) is None for _ in range(50))
    assert frequency_of(times, sway(rng, 1.0, 0.02, times), 1.0) is not None


def test_short_stretches_and_still_tails_say_nothing():
    rng = np.random.default_rng(2)
    good = run_of("a", rng, 1.0)
    still = replace(good, commands=CommandSteps([0.0], [[0.0, 0.0, 1.0, 0.0, 0.0]]))
    short = replace(
        good,
        commands=CommandSteps(
            good.time_s[[0, 65, 130, 195]], [[0.0, 0.4, f, 0.0, 0.0] for f in (1, 1.1, 1, 1.1)]
        ),
    )
    assert [len(beats_of(dataset_of([run]))) for run in (good, still, short)] == [1, 0, 0]
    position = replace(good, channels={"x": good.channels["yaw"]})
    assert beats_of(dataset_of([position])) == ()


@pytest.mark.parametrize(("ratios", "expected"), [((0.93,) * 4, False), ((0.9, 0.93, 0.98), True)])
def test_runs_that_beat_alike_are_told_from_others(ratios, expected):
    rng = np.random.default_rng(3)
    data = dataset_of(run_of(f"r{i}", rng, ratio) for i, ratio in enumerate(ratios))
    found = by_run(beats_of(data))
    assert [found[f"r{i}"][0] for i in range(len(ratios))] == pytest.approx(ratios, abs=3e-3)
    assert uneven(beats_of(data)) is expected


def test_measured_beats_take_the_place_of_commands():
    rng, fish = np.random.default_rng(4), load_fish("zheng-2021-a")
    quiet = replace(run_of("c", rng, 1.0), channels={"yaw": rng.standard_normal(260)})
    data = dataset_of([run_of("a", rng, 0.9, 1.2), run_of("b", rng, 0.98), quiet])
    told = with_measured_beats(data, fish)
    frequencies = [run.commands.values[0, 2] for run in told.runs]
    assert frequencies == pytest.approx([1.08, 0.98, 0.94], abs=4e-3)  # the last by the mean ratio
    assert "0.94" in told.notes[-1]
    assert with_measured_beats(dataset_of([quiet]), fish) == dataset_of([quiet])


@pytest.mark.parametrize(
    "effects",
    [
        {"frequency_scale": {"scale": 0.93}},
        {"clock_scale": {"scale": 1.04}},
        {"frequency_scale": {"scale": 0.93}, "clock_scale": {"scale": 1.04}},
    ],
)
def test_measured_beats_are_scaled_once(effects):
    """A fish that knows its frequency beats as measured, not at that multiple of it."""
    fish = load_fish("zheng-2021-a")
    slow = replace(fish, effects=effects)
    measured = dataset_of([run_of("a", np.random.default_rng(5), 0.93 * 1.04)])
    (run,) = with_measured_beats(measured, slow).runs
    assert recorded_beat(slow, run.commands) == pytest.approx(0.93 * 1.04, abs=4e-3)
    (run,) = with_measured_beats(measured, fish).runs
    assert recorded_beat(slow, run.commands) != pytest.approx(0.93 * 1.04, abs=0.02)


def recorded_beat(fish, commands):
    """Frequency (Hz) of the tail of a simulated fish, on its recorder's clock."""
    row = dict(zip(COMMANDS, commands.values[0].tolist(), strict=True))
    trajectory = Simulator(fish).run([{"t": 0.0, **row}], 10.0)
    phase = trajectory["tail_phase"]
    clock = fish.effects.get("clock_scale", {}).get("scale", 1.0)
    return (phase[-1] - phase[0]) / (2 * np.pi) / (trajectory.time_s[-1] / clock)


def test_a_table_of_means_holds_no_beat():
    with pytest.raises(DatasetError, match="means hold no beat"):
        diagnose("msu-steady", measured_beats=True)
