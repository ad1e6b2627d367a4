"""A law of the beat is read from the swaying of the hull, and none where the tail obeys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.diagnosis.inputs.check import check_inputs
from fish_env.diagnosis.inputs.drive_law import DriveLaw, drive_law
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.tail_drive import RATE as RATE_OF_SAG
from fish_env.identification.tail_drive import SCALE, tail_drive
from fish_env.inference.hypotheses import EffectParameterId

RATE, LENGTH, HELD, RUNS = 25.0, 30.0, 2.5, 6
FREQUENCY = 2


def swaying(seed, common=1.0, own=0.0, **law):
    """Runs whose hulls sway with tails that beat by a law; `own` is what runs differ by."""
    rng = np.random.default_rng(seed)
    return Dataset(
        "swaying",
        "zheng-2021-a",
        tuple(
            _run(f"r{i}", rng, common * (1.0 + own * rng.standard_normal()), **law)
            for i in range(RUNS)
        ),
    )


def _run(name, rng, common, rate=0.0, offset=0.0, load=0.0, beat=0.0):
    starts = np.arange(0.0, LENGTH, HELD)
    count = len(starts)
    values = np.column_stack(
        [
            rng.uniform(-0.5, 0.5, count),
            rng.uniform(0.2, 0.5, count),
            rng.uniform(1.0, 2.0, count),
            np.zeros((count, 2)),
        ]
    )
    fine = np.arange(0.0, LENGTH, 1e-3)
    told = values[np.searchsorted(starts, fine, side="right") - 1]
    speed = 2.0 * np.pi * told[:, 1] * told[:, 2]
    law = (1.0 - rate * fine) * (1.0 - offset * np.abs(told[:, 0])) * (1.0 - load * speed)
    law *= 1.0 - beat * np.tanh(np.abs(told[:, 0]) / 0.1)
    phase = 2.0 * np.pi * np.cumsum(common * law * told[:, 2]) * 1e-3
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    at = np.rint(times / 1e-3).astype(int)
    turn = np.cumsum(told[:, 0])[at] * -2e-4
    yaw = turn + 0.1 * told[at, 1] * np.sin(phase[at]) + 0.002 * rng.standard_normal(len(at))
    return Run.from_steps(name, times, {"yaw": yaw}, CommandSteps(starts, values), start="unknown")


LAWS = (
    {"rate": 0.003},
    {"offset": 0.25},
    {"offset": 0.15, "load": 0.015},
    {"rate": 0.002, "offset": 0.2},
    {"beat": 0.05},
    {"beat": 0.05, "load": 0.015},
)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: "-".join(law))
def test_a_law_is_found_with_its_size(law):
    found = drive_law(swaying(1, common=0.98, own=0.002, **law))
    sizes = {id.name: size for id, size in found.sizes.items()}
    assert sizes.keys() == law.keys()
    for name, size in law.items():
        assert sizes[name] == pytest.approx(size, rel=0.2)
    assert found.common == pytest.approx(0.98, abs=0.01)


def test_runs_of_one_window_each_have_a_common_beat():
    """Nothing then tells how the beats of the runs scatter from how windows do."""
    times, rng = np.arange(0.0, 5.0, 1.0 / 60.0), np.random.default_rng(5)
    runs = []
    for i, frequency in enumerate(np.linspace(0.5, 2.25, 9)):
        told = CommandSteps(np.zeros(1), np.array([[0.0, 0.4, frequency, 0.0, 0.0]]))
        swing = 0.1 * np.sin(2.0 * np.pi * 0.97 * frequency * times)
        yaw = swing + 0.002 * rng.standard_normal(len(times))
        runs.append(Run.from_steps(f"r{i}", times, {"yaw": yaw}, told, start="unknown"))
    law = drive_law(Dataset("short", "zheng-2021-a", tuple(runs)))
    assert law.common == pytest.approx(0.97, abs=0.01)
    assert not law.sizes


def test_tails_that_obey_have_no_law():
    found = [drive_law(swaying(seed, own=0.002)) for seed in range(20)]
    assert sum(bool(law.sizes) for law in found) <= 2  # each term is tested at 5 per cent
    assert all(abs(law.common - 1.0) < 0.005 for law in found)


def test_own_beats_of_runs_are_no_certain_law():
    """Runs that differ by two per cent: chance makes no law certain, and a law is."""
    chance = [drive_law(swaying(seed, own=0.02)).p for seed in range(20, 50)]
    assert min(chance) > CHECKS.certain_law_level
    assert sum(p < 0.05 for p in chance) <= 5  # binomial: more in one set of thirty of 300
    assert drive_law(swaying(1, own=0.02, offset=0.25)).p < CHECKS.certain_law_level


def test_without_a_beat_nothing_is_said():
    rng = np.random.default_rng(2)
    still = swaying(3)
    runs = [
        Run(r.id, r.time_s, {"yaw": rng.standard_normal(len(r.time_s))}, r.commands, "rest")
        for r in still.runs
    ]
    law = drive_law(Dataset("still", still.fish, tuple(runs)))
    assert law == DriveLaw()
    assert law.starts() == {}


@pytest.mark.parametrize("law", [{"offset": 0.25}, {"rate": 0.004}], ids=lambda law: "-".join(law))
def test_commands_follow_the_law(law):
    data = swaying(4, common=0.97, **law)
    followed = drive_law(data).following(data)
    assert drive_law(followed).sizes == {}
    assert drive_law(followed).common == pytest.approx(1.0, abs=0.005)
    assert DriveLaw(0.97).following(data) is data, "what all share is no law"


def test_a_frequency_that_falls_under_one_command_is_followed():
    """What holds for a whole run is commanded anew, in steps."""
    once = CommandSteps([0.0], [[0.1, 0.3, 1.5, 0.0, 0.0]])
    data = swaying(4)
    data = replace(data, runs=tuple(replace(run, commands=once) for run in data.runs))
    for run in DriveLaw(1.0, {RATE_OF_SAG: 0.01}).following(data).runs:
        times = np.array([0.25, 10.0, 29.0])
        told = run.commands.at(times)[:, FREQUENCY]
        assert told == pytest.approx(1.5 * (1.0 - 0.01 * times), abs=0.005)


def test_the_input_step_tells_the_law_and_leaves_it_to_effects():
    data = swaying(5, common=0.97, offset=0.25)
    inputs = check_inputs(data)
    (told,) = [fault for fault in inputs.faults if fault.target == "tail_frequency"]
    assert "beat_load" in told.said
    assert "Write" not in told.said, "no line of dataset.yaml puts it right"
    assert not inputs.binding
    assert inputs.drive[EffectParameterId("beat_load", "offset")] == pytest.approx(0.25, rel=0.2)
    assert inputs.drive[SCALE] == pytest.approx(0.97, abs=0.01)
    for run, logged in zip(inputs.dataset.runs, data.runs, strict=True):
        assert np.array_equal(run.commands.values, logged.commands.values)


def test_runs_that_differ_beside_a_law_are_put_right():
    data = swaying(6, offset=0.25, own=0.03)
    inputs = check_inputs(data)
    ratios = [
        a.commands.values[0, FREQUENCY] / b.commands.values[0, FREQUENCY]
        for a, b in zip(inputs.dataset.runs, data.runs, strict=True)
    ]
    assert np.median(ratios) == pytest.approx(1.0, abs=0.01)
    assert np.std(ratios) > 0.01
    law = drive_law(inputs.dataset)
    assert law.sizes[EffectParameterId("beat_load", "offset")] == pytest.approx(0.25, rel=0.2)


def test_runs_alike_beside_a_falling_beat_are_left_alone():
    """Their commands differ, so that means over windows do too."""
    data = swaying(7, rate=0.006)
    inputs = check_inputs(data)
    (told,) = [fault for fault in inputs.faults if fault.target == "tail_frequency"]
    assert "battery_sag" in told.said
    for run, logged in zip(inputs.dataset.runs, data.runs, strict=True):
        assert np.array_equal(run.commands.values, logged.commands.values)


def test_runs_that_differ_beside_a_falling_beat_get_their_own_ratio():
    scales = np.array([0.96, 0.98, 1.0, 1.0, 1.02, 1.04])
    rng = np.random.default_rng(8)
    runs = tuple(_run(f"r{i}", rng, scale, rate=0.005) for i, scale in enumerate(scales))
    data = Dataset("swaying", "zheng-2021-a", runs)
    inputs = check_inputs(data)
    ratios = [
        a.commands.values[0, FREQUENCY] / b.commands.values[0, FREQUENCY]
        for a, b in zip(inputs.dataset.runs, data.runs, strict=True)
    ]
    assert ratios == pytest.approx(scales, abs=0.003)


def test_a_fit_begins_in_step_only_beside_a_law():
    off = tail_drive({SCALE: 0.9})
    assert (off.in_step, off.known) == ({}, False)
    law = {SCALE: 1.001, EffectParameterId("battery_sag", "rate"): 0.002}
    assert tail_drive(law).in_step == {EffectParameterId("battery_sag", "rate"): 0.002}
    assert tail_drive({**law, SCALE: 0.95}).in_step == {**law, SCALE: 0.95}
    assert tail_drive({SCALE: 1.001}).known
    assert not tail_drive({}).known, "nothing was measured"
