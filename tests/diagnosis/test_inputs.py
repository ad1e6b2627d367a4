"""Mistakes in the data are found and named with their line; good data are left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from fish_env.data import Dataset, load_dataset, write_dataset
from fish_env.diagnosis.answer import as_dict
from fish_env.diagnosis.headline import headline
from fish_env.diagnosis.inputs import check as check_module
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.check import check_inputs, refuse_wrong_inputs
from fish_env.diagnosis.inputs.lines import Lines
from fish_env.diagnosis.inputs.search import Found, search
from fish_env.diagnosis.inputs.weighing import Scales
from fish_env.diagnosis.pipeline import diagnose_runs
from fish_env.diagnosis.report.measurements import input_checks
from fish_env.errors import DatasetError
from fish_env.params import load_fish
from tests.diagnosis.mistakes import (
    SENSORS,
    column,
    command,
    found_by,
    late,
    mistakes_of,
    sensed,
    times,
)
from tests.identification.synthetic import Setup, simulate

FIRST = 60012
"""A multiple of 18; no number of a suite or of a calibration."""
NINE, CAMERA, GYRO = "nine channels", "overhead camera", "gyro, compass and depth"
QUICK = (
    (NINE, "tail_offset reversed"),
    (NINE, "block_displacement reversed"),
    (NINE, "yaw reversed"),
    (NINE, "z reversed"),
    (NINE, "p in the finer unit"),
    (NINE, "frame enu"),
    (NINE, "mirrored"),
    (NINE, "commands exchanged"),
    (NINE, "clock 2.1"),
    (NINE, "clock of the measurements 0.5"),
    (NINE, "clock of the measurements 2.1"),
    (NINE, "commands -0.4 s late"),
    (NINE, "beat 0.75"),
    (NINE, "beat 1.3 in one run"),
    (CAMERA, "x and y exchanged"),
    (CAMERA, "tail_offset reversed"),
    (CAMERA, "clock 0.5"),
    (GYRO, "r reversed"),
    (GYRO, "block_angle reversed"),
)


def told(dataset, fish=None):
    return [fault for fault in check_inputs(dataset, fish).faults if fault.decisive]


@pytest.mark.parametrize("sensors", sorted(SENSORS))
def test_good_data_are_left_alone(sensors):
    good = sensed(sensors, FIRST)
    found = check_inputs(good)
    assert found.faults == ()
    assert found.dataset == good


@pytest.mark.parametrize(("sensors", "name"), QUICK)
def test_a_mistake_is_found_and_named_with_its_line(sensors, name):
    good = sensed(sensors, FIRST)
    mistake = mistakes_of(good)[name]
    faults = told(mistake.applied(good))
    assert found_by(mistake, faults), [fault.said for fault in faults]
    assert all(fault.binds for fault in faults)


@pytest.mark.parametrize(("after", "decisive"), [(0.32, False), (0.05, True)])
def test_a_unit_that_leaves_most_of_the_disagreement_is_a_fish_of_another_speed(after, decisive):
    """0.57 and 0.32 are those of a real fish that is slower than its file."""
    change = Change("unit", "x", 0.1, "mm", "channels: {x: mm}", "x is in mm", channels={})
    assert Found(change, 20.0, 1e-6, "speed", 0.57, after, ()).decisive is decisive


def test_one_slow_clock_is_no_quick_tail():
    """0.9 % of one log's clock: angles grow faster than rates say, and the tail beats as much."""
    good = sensed(NINE, FIRST)
    (fault,) = told(spoilt(good, times(1.009, 1.009)))
    assert fault.kind == "clock"
    assert fault.fix.startswith("clock: {scale: 1.00")
    low, high = fault.interval
    assert low < 1.009 < high
    assert fault.p < 0.01
    assert fault.alternatives == ()
    assert fault.binds


def test_a_tail_that_is_a_little_quick_is_no_wrong_clock():
    good = sensed(NINE, FIRST)
    found = check_inputs(spoilt(good, command("tail_frequency", 1.0 / 1.05)))
    (fault,) = found.faults
    assert fault.kind == "beat"
    assert fault.value == pytest.approx(1.05, abs=0.003)
    # The effect frequency_scale explains it, so the verdict is left to the search.
    assert not found.binding
    assert (
        found.dataset.runs[0].commands
        == spoilt(good, command("tail_frequency", 1.0 / 1.05)).runs[0].commands
    )


def test_late_commands_are_no_beats_that_differ():
    """Each change of the commanded frequency shifts the phase by as much as another beat would."""
    good = sensed(CAMERA, FIRST)
    found = check_inputs(spoilt(good, late(0.3)))
    (fault,) = (fault for fault in found.faults if fault.kind == "clock_offset")
    assert fault.fix == "clock: {command_offset: -0.3}"
    low, high = fault.interval
    assert low < -0.3 < high
    assert [line for line in fault.alternatives if line.startswith("runs: ")]
    assert not fault.decisive
    assert found.dataset.runs[0].commands == spoilt(good, late(0.3)).runs[0].commands


def test_a_gain_of_gyros_that_is_not_the_beats_ratio_makes_no_clock_of_it():
    """1.2 % beside a beat 1.5 % slow: two and a half standard errors apart, so neither is sure."""

    def with_gain(run):
        rates = {name: 1.0117 * run.channels[name] for name in "pqr"}
        return replace(run, channels={**run.channels, **rates})

    slow = spoilt(sensed(NINE, FIRST), command("tail_frequency", 1.0 / 0.985))
    (fault,) = check_inputs(spoilt(slow, with_gain)).faults
    assert fault.kind == "beat"
    assert not fault.binds
    assert any("clock" in line for line in fault.alternatives)


def test_a_fish_that_knows_its_beat_makes_no_fault_of_it():
    good = sensed(NINE, FIRST)
    slow = spoilt(good, command("tail_frequency", 1.0 / 0.75))
    fish = load_fish(good.fish)
    knows = replace(fish, effects={"frequency_scale": {"scale": 0.75}})
    assert check_inputs(slow, knows).faults == ()
    assert check_inputs(slow, fish).binding


def test_beats_that_differ_a_little_are_corrected_and_do_not_bind():
    good = sensed(NINE, FIRST)
    ratios = dict(zip(good.ids, np.linspace(0.93, 1.04, len(good.ids)), strict=True))
    uneven = replace(
        good,
        runs=tuple(command("tail_frequency", 1.0 / ratios[run.id])(run) for run in good.runs),
    )
    found = check_inputs(uneven)
    assert {fault.kind for fault in found.faults} == {"beat"}
    assert not found.binding
    for run, true in zip(found.dataset.runs, good.runs, strict=True):
        assert np.allclose(run.commands.values, true.commands.values, rtol=5e-3)


def test_rates_and_speeds_that_were_differentiated_are_no_evidence():
    camera = sensed(CAMERA, FIRST)
    found = check_inputs(with_derived(camera))
    assert {fault.target for fault in found.faults} == {"u", "v", "r"}
    assert all(fault.kind == "derived" and not fault.binds for fault in found.faults)
    assert found.dataset.channels == camera.channels
    # A gyro of its own is evidence.
    assert "r" in check_inputs(sensed(NINE, FIRST)).dataset.channels


def with_derived(dataset):
    """The overhead camera's u, v and r by differences of x, y and yaw."""
    runs = []
    for run in dataset.runs:
        seen = np.isfinite(run.channels["x"])
        time = run.time_s[seen]
        x, y, yaw = (run.channels[name][seen] for name in ("x", "y", "yaw"))
        yaw = np.unwrap(yaw)
        east, north = np.gradient(y, time), np.gradient(x, time)
        values = {
            "u": np.cos(yaw) * north + np.sin(yaw) * east,
            "v": -np.sin(yaw) * north + np.cos(yaw) * east,
            "r": np.gradient(yaw, time),
        }
        more = {name: np.full(len(seen), np.nan) for name in values}
        for name, value in values.items():
            more[name][seen] = value
        runs.append(replace(run, channels={**run.channels, **more}))
    return replace(dataset, runs=tuple(runs), noise={})


def spoilt(dataset, spoil) -> Dataset:
    return replace(dataset, runs=tuple(map(spoil, dataset.runs)), noise={})


WRITTEN = {
    "yaw reversed": column("yaw", -1.0),
    "tail_offset reversed": command("tail_offset", -1.0),
    "clock": times(0.5, 0.5),
    "clock of the commands": times(1.0, 1.3),
}


@pytest.mark.parametrize("name", sorted(WRITTEN))
def test_the_line_that_is_named_puts_the_file_right(name, tmp_path):
    good = sensed(NINE, FIRST)
    folder = write_dataset(spoilt(good, WRITTEN[name]), tmp_path / "data")
    (fault,) = told(load_dataset(folder))
    file = folder / "dataset.yaml"
    content = yaml.safe_load(file.read_text())
    for section, value in yaml.safe_load(fault.fix).items():
        content[section] = {**content.get(section, {}), **value}
    file.write_text(yaml.safe_dump(content, sort_keys=False))
    assert told(load_dataset(folder)) == []


def test_lines_name_columns_and_units_as_the_file_does():
    good = replace(
        sensed(NINE, FIRST),
        declared={"yaw": ("heading", "deg"), "depth": ("depth", "cm"), "x": ("e", "m")},
        frame="enu",
    )
    lines = Lines(good)
    assert lines.signs(("yaw",)) == "channels: {yaw: {column: heading, unit: deg, sign: -1}}"
    assert lines.units(("z",), "mm") == "channels: {depth: mm}"
    assert lines.offset("yaw", np.pi / 2) == (
        "channels: {yaw: {column: heading, unit: deg, offset: -90}}"
    )
    # x of the model is y of the file.
    assert lines.signs(("y",)) == "channels: {x: {column: e, unit: m, sign: -1}}"


def test_what_is_told_is_what_the_search_finds_and_puts_right():
    bad = spoilt(sensed(NINE, FIRST), column("yaw", -1.0))
    (fault,), scales = told(bad), Scales(load_fish(bad.fish))
    (found,), right = search(bad, scales)
    assert (fault.fix, fault.log_evidence) == (found.change.line, found.gain)
    assert search(right, scales)[0] == []


def test_a_fit_refuses_what_binds():
    bad = spoilt(sensed(NINE, FIRST), column("r", -1.0))
    with pytest.raises(DatasetError, match=r"r has the wrong sign.*channels: \{r: "):
        refuse_wrong_inputs(bad)
    refuse_wrong_inputs(sensed(NINE, FIRST))


def test_the_answer_says_it_under_every_verdict():
    bad = spoilt(sensed(NINE, FIRST), column("r", -1.0))
    found = check_inputs(bad)
    entries = found.as_list()
    quiet = {"gain": None, "causes": [], "budget": None, "preconditions": [], "unexplained": [],
             "alternatives": []}  # fmt: skip
    answer = {**quiet, "inputs": entries, "verdict_once_corrected": "no_misfit"}
    bound = headline({**answer, "verdict": "inputs"})
    assert bound.verdict.startswith("r has the wrong sign. Once corrected: No model error")
    assert bound.next_step.startswith("write `channels: {r: {unit: rad/s, sign: -1}}` into")
    assert "channels: {r: {unit: rad/s, sign: -1}}" in input_checks(answer, None, None)
    assert input_checks({"inputs": []}, None, None) == ""


def test_what_was_put_right_is_noted_with_the_data():
    found = check_inputs(spoilt(sensed(NINE, FIRST), column("r", -1.0)))
    assert found.dataset.notes[-1] == "inputs: r has the wrong sign"
    assert found.logged.notes == sensed(NINE, FIRST).notes
    assert check_module.without(found.dataset, ["r"]).channels[-1] == "q"


def noise_in_place_of(dataset, seed):
    """The same runs and commands; channels hold white noise."""
    rng = np.random.default_rng(seed)
    runs = tuple(
        replace(run, channels={n: rng.normal(0.0, 0.3, a.shape) for n, a in run.channels.items()})
        for run in dataset.runs
    )
    return replace(dataset, runs=runs)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_noise_in_place_of_measurements_is_no_wrong_unit(seed):
    """Positions that are nothing but noise look fast, as centimetres for millimetres would."""
    noise = noise_in_place_of(simulate(Setup(runs=8, duration=30.0)), seed)
    assert [fault.kind for fault in check_inputs(noise).faults] == [check_module.SILENCE]
    found, _ = search(noise, Scales(load_fish(noise.fish)))
    assert found == []


def test_runs_of_noise_only_are_no_matter_of_the_model():
    moving = simulate(Setup())
    assert not check_inputs(moving).silent
    found = check_inputs(noise_in_place_of(moving, 5))
    assert found.silent
    assert found.binding
    assert "No channel shows a motion" in found.faults[0].said
    with pytest.raises(DatasetError, match="sensors were on"):
        refuse_wrong_inputs(noise_in_place_of(moving, 5))


def test_a_fish_that_rests_may_hold_noise_only():
    noise = noise_in_place_of(simulate(Setup()), 5)
    at_rest = [replace(run, commands=resting(run.commands)) for run in noise.runs]
    assert not check_inputs(replace(noise, runs=tuple(at_rest))).silent


def resting(commands):
    """The commands with a tail that does not beat, and nothing else that moves."""
    return replace(commands, values=np.zeros_like(commands.values))


def test_no_cause_is_searched_for_in_noise():
    dataset = noise_in_place_of(simulate(Setup()), 5)
    answer = as_dict(diagnose_runs(dataset, quick=True))
    assert answer["verdict"] == "inputs"
    assert not answer["causes"]
    assert not answer["ranking"]
    assert not answer["unexplained"]
    assert not answer["doubts"]
    assert answer["budget"] is None
    said = headline(answer)
    assert said.verdict.startswith("No channel shows a motion")
    assert "Once corrected" not in said.verdict
    assert "measure again" in said.next_step
