"""Columns under other names, signs, scales and units; clocks of any unit."""

import math

import numpy as np
import pytest

from fish_env.comparison.runs import compare_runs
from fish_env.data import Dataset, Run, load_dataset
from fish_env.data.schema import CommandSteps
from fish_env.diagnosis.input_checks import check_runs
from fish_env.errors import DatasetError
from fish_env.params import load_fish
from tests.command_line import run as command
from tests.fixtures.measured_data import DESCRIPTION, RUN, good_folder, steady_folder

MILLIMETRES = RUN.replace("t,x,", "t,pos_x,")


def first_run(folder) -> Run:
    dataset = load_dataset(folder)
    assert isinstance(dataset, Dataset)
    return dataset.runs[0]


def refusal(folder) -> str:
    with pytest.raises(DatasetError) as caught:
        load_dataset(folder)
    return str(caught.value)


def test_a_column_has_a_name_a_sign_a_scale_and_a_unit(tmp_path):
    x = {"column": "pos_x", "sign": -1, "scale": 0.5, "unit": "millimeters"}
    folder = good_folder(tmp_path, MILLIMETRES, channels={"x": x, "z": "m", "yaw": "rad"})
    expected = -0.5e-3 * np.array([0.0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(first_run(folder).channels["x"], expected, rtol=1e-14)
    assert math.copysign(1.0, first_run(folder).channels["x"][0]) == 1.0


def test_a_command_has_them_too(tmp_path):
    offset = {"column": "servo", "sign": -1, "unit": "degrees"}
    commands = DESCRIPTION["commands"] | {"tail_offset": offset}
    folder = good_folder(tmp_path, RUN.replace("tail_offset", "servo"), commands=commands)
    assert first_run(folder).commands.values[0, 0] == pytest.approx(math.radians(-0.2))


def test_a_steady_table_has_them_too(tmp_path):
    speed = {"column": "surge", "scale": 2, "unit": "cm/sec"}
    table = "surge,tail_offset,tail_amplitude,tail_frequency\n5,0,20,1\n"
    dataset = load_dataset(steady_folder(tmp_path, table, channels={"surge_speed": speed}))
    assert dataset.observations["surge_speed"][0] == pytest.approx(0.1)


def test_a_column_may_be_in_a_frame_of_its_own(tmp_path):
    # The camera is in enu, the compass gives degrees clockwise from north.
    heading = {"column": "heading", "unit": "deg", "frame": "ned"}
    run = RUN.replace(",yaw,", ",heading,").replace("t,x,z", "t,y,z")
    folder = good_folder(
        tmp_path, run, frame="enu", channels={"y": "m", "z": "m", "yaw": heading}, noise={"y": 0.1}
    )
    measured = first_run(folder)
    np.testing.assert_allclose(measured.channels["yaw"][0], math.radians(0.1))
    np.testing.assert_array_equal(measured.channels["x"], [0.0, 0.01, 0.02, 0.03])
    assert measured.channels["z"][0] == -0.5
    assert load_dataset(folder).noise == {"x": 0.1}


def test_a_command_may_be_in_a_frame_of_its_own(tmp_path):
    offset = {"unit": "rad", "frame": "enu"}
    folder = good_folder(tmp_path, commands=DESCRIPTION["commands"] | {"tail_offset": offset})
    assert first_run(folder).commands.values[0, 0] == -0.2


def test_one_channel_cannot_come_from_two_frames(tmp_path):
    channels = {"x": "m", "y": {"column": "z", "unit": "m", "frame": "enu"}}
    message = refusal(good_folder(tmp_path, channels=channels))
    assert "column x" in message
    assert "swap" in message


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        ({"column": "pos_x"}, ["key channels.x.unit", "missing"]),
        ({"column": "pos_x", "unit": "m", "sing": -1}, ["key channels.x.sing", "'sign'"]),
        ({"column": "pos_x", "unit": "m", "sign": -2}, ["key channels.x.sign", "-2", "scale"]),
        ({"column": "pos_x", "unit": "m", "scale": 0}, ["key channels.x.scale", "0"]),
        ({"column": "pos_x", "unit": "pixels"}, ["key channels.x.unit", "pixel", "scale"]),
        ({"column": "posx", "unit": "m"}, ["row 1", "column posx", "pos_x"]),
        ({"column": "z", "unit": "m"}, ["z and x are both read from the column 'z'"]),
        ({"column": "t", "unit": "m"}, ["x and the time", "'t'"]),
    ],
)
def test_what_is_wrong_with_a_column_is_said(tmp_path, x, expected):
    channels = {"x": x, "z": "m", "yaw": "rad"}
    message = refusal(good_folder(tmp_path, MILLIMETRES, channels=channels))
    assert all(words in message for words in expected), message


def test_a_wrong_cell_is_named_by_the_column_of_the_file(tmp_path):
    run = MILLIMETRES.replace("0.1,0.01", "0.1,near")
    x = {"column": "pos_x", "unit": "m"}
    message = refusal(good_folder(tmp_path, run, channels={"x": x, "z": "m", "yaw": "rad"}))
    assert "row 3, column pos_x: 'near'" in message


@pytest.mark.parametrize(
    ("channel", "unit", "factor"),
    [
        ("yaw", "degrees", math.pi / 180.0),
        ("yaw", "°", math.pi / 180.0),
        ("yaw", "Grad", math.pi / 180.0),
        ("yaw", "Radians", 1.0),
        ("r", "°/s", math.pi / 180.0),
        ("r", "degrees per second", math.pi / 180.0),
        ("r", "rpm", 2.0 * math.pi / 60.0),
        ("x", "meters", 1.0),
        ("x", "MM", 1e-3),
        ("x", "inches", 0.0254),
        ("u", "m·s⁻¹", 1.0),
    ],
)
def test_units_may_be_spelt_in_any_way(tmp_path, channel, unit, factor):
    run = RUN.replace("t,x,z,yaw", f"t,{channel},b,c")
    folder = good_folder(tmp_path, run, channels={channel: unit})
    expected = factor * np.array([0.0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(first_run(folder).channels[channel], expected, rtol=1e-14)


@pytest.mark.parametrize(("unit", "hertz"), [("hz", 1.0), ("rpm", 1 / 60), ("rad/s", 0.5 / np.pi)])
def test_a_turn_is_one_cycle_of_the_tail(tmp_path, unit, hertz):
    commands = DESCRIPTION["commands"] | {"tail_frequency": unit}
    folder = good_folder(tmp_path, commands=commands)
    assert first_run(folder).commands.values[0, 2] == pytest.approx(hertz)


@pytest.mark.parametrize("unit", ["degs per", "degreees", "d"])
def test_a_unit_of_another_kind_is_never_proposed(tmp_path, unit):
    message = refusal(good_folder(tmp_path, channels={"x": "m", "yaw": unit}))
    assert "rad, deg" in message
    assert "/s" not in message


def test_a_unit_that_may_be_degrees_or_gradians_is_refused(tmp_path):
    message = refusal(good_folder(tmp_path, channels={"x": "m", "yaw": "grad"}))
    assert "degrees or gradians" in message
    assert "Write deg or gon" in message


def test_radians_that_can_only_be_degrees_are_refused_in_any_spelling(tmp_path):
    run = RUN.replace("0.0,0.0,0.5,0.1", "0.0,0.0,0.5,30")
    message = refusal(good_folder(tmp_path, run, channels={"x": "m", "yaw": "radians"}))
    assert "can only be degrees" in message


def test_code_in_a_unit_is_not_run(tmp_path):
    evil = f"__import__('pathlib').Path(r'{tmp_path}/run').touch()"
    assert "unknown unit" in refusal(good_folder(tmp_path, channels={"x": evil}))
    assert not (tmp_path / "run").exists()


EPOCH = 1_700_000_000_123_456_789


@pytest.mark.parametrize(
    ("unit", "cells"),
    [
        ("s", ["5.0", "5.1", "5.25", "5.3"]),
        ("ms", ["5000", "5100", "5250", "5300"]),
        ("microseconds", ["5e6", "5.1e6", "5.25e6", "5.3e6"]),
    ],
)
def test_a_clock_has_a_name_and_any_unit(tmp_path, unit, cells):
    folder = clocked(tmp_path, cells, {"column": "stamp", "unit": unit})
    np.testing.assert_allclose(first_run(folder).time_s, [5.0, 5.1, 5.25, 5.3], rtol=1e-14)


@pytest.mark.parametrize(
    ("unit", "cells"),
    [
        ("ns", [str(EPOCH + step) for step in (0, 100_000_000, 250_000_000, 300_000_000)]),
        ("ms", ["1700000000000.0", "1700000000100.0", "1700000000250.0", "1700000000300.0"]),
        ("iso", [f"2026-05-01T23:59:59.{ms}Z" for ms in ("000", "100", "250", "300")]),
        ("ISO", [f"2026-05-01 12:00:00.{ms}" for ms in ("0", "1", "25", "3")]),
        ("iso", [f"12:00:00.{ms}" for ms in ("000", "100", "250", "300")]),
    ],
)
def test_a_clock_that_counts_from_a_date_begins_at_zero(tmp_path, unit, cells):
    folder = clocked(tmp_path, cells, {"column": "stamp", "unit": unit})
    np.testing.assert_allclose(first_run(folder).time_s, [0.0, 0.1, 0.25, 0.3], atol=1e-12)
    assert "the run begins at t = 0" in load_dataset(folder).notes[0]


def clocked(folder, cells, time, **changes):
    lines = RUN.splitlines()
    rows = [f"{cell},{line.partition(',')[2]}" for cell, line in zip(cells, lines[1:], strict=True)]
    return good_folder(
        folder, "\n".join([lines[0].replace("t,x", "stamp,x"), *rows]), time=time, **changes
    )


@pytest.mark.parametrize(
    ("time", "cells", "expected"),
    [
        ({"column": "stamp", "unit": "m"}, "0123", ["key time.unit", "time"]),
        ({"column": "clock"}, "0123", ["column clock", "stamp"]),
        ({"column": "stamp", "units": "s"}, "0123", ["key time.units", "'unit'"]),
        ({"column": "stamp", "unit": "iso"}, "0123", ["row 2", "column stamp", "'0'", "2026-"]),
        ({"column": "stamp", "unit": "ms"}, "0132", ["row 5", "column stamp", "does not increase"]),
    ],
)
def test_what_is_wrong_with_a_clock_is_said(tmp_path, time, cells, expected):
    message = refusal(clocked(tmp_path, list(cells), time))
    assert all(words in message for words in expected), message


def test_stamps_of_two_kinds_are_refused(tmp_path):
    cells = ["2026-05-01T12:00:00", "2026-05-01T12:00:00.1Z", "12:00:00.2", "12:00:00.3"]
    message = refusal(clocked(tmp_path, cells, {"column": "stamp", "unit": "iso"}))
    assert "alike" in message


def swim(interval: float, count: int = 60) -> str:
    """A run with that many units of its clock between samples."""
    rows = [
        f"{k * interval:g},{0.004 * k:g},0.5,{0.01 * (k % 7)},0,0.3,2,0,0" for k in range(count)
    ]
    return "\n".join([RUN.splitlines()[0], *rows]) + "\n"


@pytest.mark.parametrize("subcommand", ["compare", "diagnose"])
@pytest.mark.parametrize(("interval", "unit"), [(40, "ms"), (1, "ms"), (40_000, "us"), (4e7, "ns")])
def test_a_clock_that_cannot_be_in_seconds_is_refused(tmp_path, capsys, subcommand, interval, unit):
    folder = good_folder(tmp_path, swim(interval))
    status, _, err = command(capsys, subcommand, str(folder))
    assert status == 2
    for words in ("r01.csv, run r01, column t", "seconds", f"unit: {unit}"):
        assert words in err


def test_a_clock_that_counts_rows_is_named(tmp_path):
    assert "count of the rows" in refusal(good_folder(tmp_path, swim(1)))
    assert "count of" not in refusal(good_folder(tmp_path, swim(40)))


@pytest.mark.parametrize(
    ("interval", "declared", "unit"),
    [(0.04, "ms", "s"), (40, "us", "ms"), (40, "ns", "ms"), (4e4, "ns", "us"), (4e-5, "s", "s")],
)
def test_a_clock_that_is_quicker_than_any_log_is_refused(tmp_path, interval, declared, unit):
    """It comes before speeds that such a clock makes impossible are taken for millimetres."""
    text = refusal(good_folder(tmp_path, swim(interval, 600), time={"unit": declared}))
    assert f"apart (mean) if this clock is in {declared}" in text
    assert f"unit: {unit}}}" in text
    assert "column t:" in text


def test_rows_of_sensors_in_bursts_are_no_quick_clock(tmp_path):
    lines = swim(0.02).splitlines()
    bursts = [f"{float(a) + (0.02 - 5e-5) * (i % 2 == 0):.6f},{b}" for i, line in
              enumerate(lines[1:]) for a, b in [line.split(",", 1)]]  # fmt: skip
    time = first_run(good_folder(tmp_path, "\n".join([lines[0], *bursts]) + "\n")).time_s
    assert np.diff(time).min() < 1e-4


@pytest.mark.parametrize(
    ("stamp", "declared", "unit"),
    [
        ("170000000{:04d}", None, "ms"), ("170000000{:04d}000", None, "us"),
        ("170000000{:04d}000000", None, "ns"), ("170000000{:04d}", "s", "ms"),
        ("170000000{:04d}000", "ms", "us"),
    ],
)  # fmt: skip
def test_the_unit_of_a_stamp_that_is_no_date_is_named(tmp_path, stamp, declared, unit):
    time = {"column": "stamp"} | ({"unit": declared} if declared else {})
    message = refusal(clocked(tmp_path, [stamp.format(ms) for ms in (0, 100, 250, 300)], time))
    assert f"it looks like {unit} since 1970" in message
    assert f"time: {{column: stamp, unit: {unit}}}" in message


@pytest.mark.parametrize("time", [{"column": "t", "unit": "ms"}, None])
def test_a_clock_in_its_unit_is_read(tmp_path, time):
    interval = 0.04 if time is None else 40
    measured = first_run(good_folder(tmp_path, swim(interval), time=time))
    np.testing.assert_allclose(measured.time_s[:3], [0.0, 0.04, 0.08], rtol=1e-12)


def test_seconds_that_are_declared_are_believed(tmp_path):
    folder = good_folder(tmp_path, swim(1.0), time={"unit": "s"})
    assert first_run(folder).time_s[1] == 1.0
    slow = swim(1.0).replace("0.3,2,0,0", "0.3,0.2,0,0")
    assert first_run(good_folder(tmp_path, slow)).time_s[1] == 1.0


@pytest.mark.parametrize(
    "refuse", [check_runs, lambda data: compare_runs(data, load_fish(data.fish))]
)
def test_milliseconds_in_memory_are_refused(refuse):
    time = np.arange(100) * 40.0
    x, y = np.random.default_rng(0).normal(0.0, 1.0, (2, 100))
    commands = CommandSteps(time[:1], np.zeros((1, 5)))
    run = Run("a", time, {"x": x, "y": y}, commands, "rest", 0.0)
    with pytest.raises(DatasetError, match=r"40 s apart .* clock were in ms, .* in seconds"):
        refuse(Dataset("d", "zheng-2021-a", (run,)))
