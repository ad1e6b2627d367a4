"""Bad input is refused with the file, the run, the row, the reason and a remedy."""

import re

import numpy as np
import pytest
import yaml

from fish_env.data import load_dataset
from fish_env.errors import DatasetError
from tests.fixtures.measured_data import (
    DESCRIPTION,
    RUN,
    STEADY,
    TABLE,
    description,
    good_folder,
    steady_folder,
    write_folder,
)

RUN_ENTRY = DESCRIPTION["runs"][0]


def refusal(folder) -> str:
    with pytest.raises(DatasetError) as caught:
        load_dataset(folder)
    return str(caught.value)


def cells(row: int, column: str, value: str, run: str = RUN) -> str:
    """The run with one cell changed; rows count from 1, the header."""
    lines = [line.split(",") for line in run.splitlines()]
    lines[row - 1][lines[0].index(column)] = value
    return "\n".join(",".join(line) for line in lines) + "\n"


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (cells(3, "t", "0.0"), ["row 3", "column t", "does not increase"]),
        (cells(4, "t", "0.05"), ["row 4", "column t", "does not increase"]),
        (cells(4, "t", ""), ["row 4", "column t", "empty"]),
        (cells(4, "t", "inf"), ["row 4", "column t", "finite"]),
        (cells(3, "x", "near"), ["row 3", "column x", "'near'"]),
        (cells(5, "x", "-inf"), ["row 5", "column x", "'-inf'"]),
        (cells(5, "x", "1e999"), ["row 5", "column x", "finite"]),
        (cells(2, "yaw", "30"), ["row 2", "column yaw", "can only be degrees"]),
        (cells(5, "tail_offset", "20"), ["row 5", "column tail_offset", "can only be degrees"]),
        (cells(5, "tail_amplitude", "20"), ["row 5", "column tail_amplitude", "degrees"]),
        (cells(5, "tail_amplitude", "-0.1"), ["row 5", "column tail_amplitude", "negative"]),
        (cells(5, "tail_frequency", "-1"), ["row 5", "column tail_frequency", "negative"]),
        (cells(5, "tail_frequency", "60"), ["row 5", "column tail_frequency", "60 Hz"]),
        (cells(5, "block_displacement", "15"), ["row 5", "column block_displacement", "'m'"]),
        (cells(3, "block_angle", ""), ["row 3", "column block_angle", "empty"]),
        (cells(3, "block_angle", "nan"), ["row 3", "column block_angle", "empty"]),
        (RUN.replace("0.14,0.2,0.3", "0.14,0.2,0.3,9"), ["row 4", "10 cells", "9"]),
        (RUN.replace("0.14,0.2,0.3", "0.14,0.2"), ["row 4", "8 cells"]),
        (RUN.replace("0.25", "\n0.25"), ["row 4", "0 cells"]),
        (RUN.replace(",", ";"), ["row 1", "column t"]),
        (RUN.replace("t,x", "time,x"), ["row 1", "column t", "not in the file"]),
        (RUN.replace(",yaw,", ",heading,"), ["row 1", "column yaw", "not in the file"]),
        (RUN.replace("tail_offset", "offset"), ["row 1", "column tail_offset"]),
        (RUN.replace(",z,", ",x,"), ["row 1", "column x", "two columns"]),
        ("", ["the file is empty"]),
        (RUN.splitlines()[0] + "\n", ["0 rows"]),
        ("\n".join(RUN.splitlines()[:2]), ["1 rows", "at least 2"]),
        (RUN.replace("0.5,", ",").replace("0.52", "").replace("0.53", ""), ["column z", "no row"]),
        (RUN.replace("0.12", '"0.12'), ["not a CSV row"]),
        (RUN + ",,,,,,,,\n", ["row 6", "column t", "empty"]),
    ],
)
def test_bad_run_files(tmp_path, run, expected):
    message = refusal(good_folder(tmp_path, run))
    for words in ["r01.csv", "run r01", *expected]:
        assert words in message
    assert message.endswith(".")


@pytest.mark.parametrize(
    ("channel", "unit", "value", "expected"),
    [
        ("pitch", "rad", "1.7", "1.7 rad is outside -1.591 to 1.591"),
        ("pitch", "deg", "95", "95 deg is outside"),
        ("pitch", "rad", "20", "can only be degrees"),
        ("roll", "rad", "3.5", "can only be degrees"),
        ("roll", "deg", "190", "190 deg is outside"),
        ("tail_angle", "rad", "25", "can only be degrees"),
        ("p", "rad/s", "40", "'deg/s'"),
        ("r", "deg/s", "2100", "outside -2005"),
    ],
)
def test_channel_out_of_range(tmp_path, channel, unit, value, expected):
    run = cells(4, channel, value, RUN.replace(",x,", f",{channel},"))
    message = refusal(good_folder(tmp_path, run, channels={channel: unit}))
    assert all(words in message for words in ("run r01", "row 4", f"column {channel}", expected))


@pytest.mark.parametrize("channel", ["yaw", "r"])
def test_slow_turning_in_degrees_declared_as_radians(tmp_path, channel):
    # Within every absolute bound, and yet no fish beats its heading about like this.
    time = np.arange(0.0, 5.0, 0.05)
    swing = 6.0 * np.sin(2.0 * np.pi * 1.5 * time)
    values = swing if channel == "yaw" else 3.0 * swing
    rows = "".join(f"{t!r},{a!r}\n" for t, a in zip(time.tolist(), values.tolist(), strict=True))
    constants = dict.fromkeys(DESCRIPTION["commands"], 0.0)
    unit = "rad" if channel == "yaw" else "rad/s"
    changes = {"commands": {}, "constant_commands": constants}
    folder = good_folder(tmp_path, f"t,{channel}\n{rows}", channels={channel: unit}, **changes)
    message = refusal(folder)
    assert re.search(rf"run r01, row \d+, column {channel}", message)
    assert "can only be degrees" in message
    declared = {channel: unit.replace("rad", "deg")}
    load_dataset(good_folder(tmp_path, f"t,{channel}\n{rows}", channels=declared, **changes))


@pytest.mark.parametrize(
    ("row", "expected"),
    [("1,0.71,0,0,0.71", None), ("1,0.7,0,0,0.7", "norm 0.9899"), ("1,1,0,,0", "missing")],
)
def test_bad_quaternions(tmp_path, row, expected):
    changes = {
        "channels": dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
        "commands": {},
        "constant_commands": dict.fromkeys(DESCRIPTION["commands"], 0.0),
    }
    folder = good_folder(tmp_path, f"t,qw,qx,qy,qz\n0,1,0,0,0\n{row}\n", **changes)
    if expected is None:
        load_dataset(folder)
        return
    message = refusal(folder)
    assert all(words in message for words in ("run r01", "row 3", "qw", expected))


def positions(scale, channel="x", unit="m"):
    """Six seconds of swimming at 0.1 m/s, written in units that are `scale` to the metre."""
    time = np.arange(0.0, 6.0, 0.1)
    rows = "".join(f"{t!r},{0.1 * scale * t!r},0.4\n" for t in time.tolist())
    constants = {**dict.fromkeys(DESCRIPTION["commands"], 0.0), "tail_frequency": 1.0}
    constants.pop("tail_amplitude")
    changes = {
        "channels": {channel: unit},
        "commands": {"tail_amplitude": "rad"},
        "constant_commands": constants,
    }
    return f"t,{channel},tail_amplitude\n{rows}", changes


@pytest.mark.parametrize(
    ("scale", "unit", "expected"),
    [(1000.0, "m", "smaller unit than 'm'"), (1000.0, "cm", None), (100.0, "cm", None),
     (1.0, "mm", "the unit 'm' instead of 'mm'"), (1000.0, "mm", None), (1.0, "m", None)],
)  # fmt: skip
def test_positions_in_another_unit(tmp_path, scale, unit, expected):
    run, changes = positions(scale, unit=unit)
    folder = good_folder(tmp_path, run, **changes)
    if expected is None:
        load_dataset(folder)
        return
    message = refusal(folder)
    assert all(words in message for words in ("run r01", "column x", expected))


def test_positions_that_hardly_move_are_all_named(tmp_path):
    """Which of them has the wrong unit cannot be told: a depth in cm may well stay where it is."""
    run, changes = positions(1.0, unit="mm")
    lines = [f"{line},{'depth' if i == 0 else 40 + i % 2}" for i, line in enumerate(run.split())]
    changes["channels"]["depth"] = "cm"
    message = refusal(good_folder(tmp_path, "\n".join(lines) + "\n", **changes))
    for words in ("column depth, x", "depth 10 mm, x 0.59 mm", "'m' instead of 'cm', 'mm'"):
        assert words in message


def test_what_moves_too_fast_may_be_due_to_the_clock(tmp_path):
    run, changes = positions(1000.0)
    assert "or the times if the samples are not 0.1 s apart" in refusal(
        good_folder(tmp_path, run, **changes)
    )
    yaw = "".join(f"{0.1 * i:.1f},{1.5 * (-1) ** i},0.4\n" for i in range(40))
    _, changes = positions(1.0, "yaw", "rad")
    message = refusal(good_folder(tmp_path, f"t,yaw,tail_amplitude\n{yaw}", **changes))
    assert "or the times if the samples are not 0.1 s apart" in message


def test_a_depth_above_the_surface(tmp_path):
    run, changes = positions(-1.0, "depth")
    assert "is outside -0.5 to inf" in refusal(
        good_folder(tmp_path, run + "6.0,-0.7,0.4\n", **changes)
    )


def test_a_quaternion_with_its_scalar_last(tmp_path):
    yaw = np.linspace(-3.0, 3.0, 40)
    columns = np.column_stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)])
    changes = {
        "channels": dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
        "commands": {},
        "constant_commands": dict.fromkeys(DESCRIPTION["commands"], 0.0),
    }
    for order, right in ((slice(None), True), ([1, 2, 3, 0], False)):
        rows = "".join(
            f"{0.1 * i:.1f}," + ",".join(map(repr, row)) + "\n"
            for i, row in enumerate(columns[:, order].tolist())
        )
        folder = good_folder(tmp_path, f"t,qw,qx,qy,qz\n{rows}", **changes)
        if right:
            load_dataset(folder)
        else:
            assert "scalar as the last" in refusal(folder)


def test_one_file_under_two_paths(tmp_path):
    entries = [RUN_ENTRY, RUN_ENTRY | {"id": "r02", "file": "./r01.csv"}]
    assert "two runs have the file" in refusal(good_folder(tmp_path, runs=entries))


def test_contradicting_depth(tmp_path):
    run = RUN.replace(",x,", ",depth,")
    message = refusal(good_folder(tmp_path, run, channels={"depth": "m", "z": "m"}))
    assert all(
        words in message for words in ("run r01", "row 2", "column depth", "differ by 0.5 m")
    )


@pytest.mark.parametrize("key", ["format", "name", "fish", "frame", "channels", "commands", "runs"])
def test_missing_keys(tmp_path, key):
    message = refusal(good_folder(tmp_path, **{key: None}))
    assert f"dataset.yaml, key {key}: the key '{key}' is missing" in message


@pytest.mark.parametrize("key", ["id", "file", "start", "tail_phase"])
def test_missing_run_keys(tmp_path, key):
    entry = {name: value for name, value in RUN_ENTRY.items() if name != key}
    message = refusal(good_folder(tmp_path, runs=[entry]))
    assert f"the key '{key}' is missing" in message
    assert key == "id" or "run r01" in message


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "robotic-fish-measurements/2"}, ["key format", "measurements/1"]),
        ({"frame": "nwu"}, ["key frame", "ned, enu"]),
        ({"kind": "stedy"}, ["key kind", "steady"]),
        ({"fish": "zheng-2012-a"}, ["key fish", "'zheng-2021-a'"]),
        ({"fish": "absent.yaml"}, ["key fish", "absent.yaml"]),
        ({"nose": {"x": 1}}, ["key nose", "'noise'"]),
        ({"name": ["a"]}, ["key name", "text"]),
        ({"time": "stamp"}, ["key time", "Write it as {column: stamp, unit: s}"]),
        ({"channels": {}}, ["key channels", "no channel"]),
        ({"channels": ["x"]}, ["key channels", "key: value"]),
        ({"channels": {"x": "m", "heading": "rad"}}, ["key channels.heading", "unknown channel"]),
        ({"channels": {"x": "parsnip"}}, ["key channels.x", "unknown unit 'parsnip'"]),
        ({"channels": {"x": "rad"}}, ["key channels.x", "'rad'", "length"]),
        ({"channels": {"yaw": "rad/s"}}, ["key channels.yaw", "angle"]),
        ({"channels": {"t": "mm", "x": "m"}}, ["key channels.t", "'mm'", "time"]),
        ({"channels": {"qw": "1", "qx": "1"}}, ["only qw, qx"]),
        (
            {"channels": {"qw": "1", "qx": "1", "qy": "1", "qz": "1", "yaw": "rad"}},
            ["declared twice"],
        ),
        ({"commands": {"tail": "rad"}}, ["key commands.tail", "unknown command"]),
        ({"commands": {"tail_offset": "rad"}}, ["not declared", "constant_commands", "tail_amp"]),
        ({"constant_commands": {"tail_offset": 0.0}}, ["key constant_commands.tail_offset"]),
        ({"noise": {"y": 0.1}}, ["key noise.y", "unknown channel"]),
        ({"noise": {"x": -0.1}}, ["key noise.x", "standard deviation"]),
        ({"noise": {"x": "low"}}, ["key noise.x", "'low'"]),
        ({"noise": {"yaw": 3.0}}, ["key noise.yaw", "degrees"]),
        ({"runs": []}, ["key runs", "list"]),
        ({"runs": "r01.csv"}, ["key runs", "list"]),
        ({"runs": ["r01.csv"]}, ["key runs", "key: value"]),
        ({"runs": [RUN_ENTRY, RUN_ENTRY | {"file": "b.csv"}]}, ["id 'r01'"]),
        ({"runs": [RUN_ENTRY, RUN_ENTRY | {"id": "r02"}]}, ["two runs have the file"]),
        ({"runs": [RUN_ENTRY | {"start": "moving"}]}, ["run r01", "key start", "rest, unknown"]),
        ({"runs": [RUN_ENTRY | {"tail_phase": "some"}]}, ["run r01", "key tail_phase", "'some'"]),
        ({"runs": [RUN_ENTRY | {"tail_phase": 90}]}, ["run r01", "key tail_phase", "degrees"]),
        ({"runs": [RUN_ENTRY | {"condtion": "A"}]}, ["'condtion'", "'condition'"]),
        ({"runs": [RUN_ENTRY | {"file": "r1.csv"}]}, ["r1.csv, run r01", "no such file", "r01"]),
        ({"file": "table.csv"}, ["key file", "unknown key"]),
    ],
)
def test_bad_descriptions(tmp_path, changes, expected):
    message = refusal(good_folder(tmp_path, **changes))
    for words in expected:
        assert words in message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "empty"),
        ("a: [1", "not valid YAML"),
        ("- a\n- b\n", "key: value"),
        ("? [a]\n: b\n", "not valid YAML"),
        (yaml.safe_dump(DESCRIPTION) + "\nname: again\n", "the key 'name' occurs twice"),
    ],
)
def test_unreadable_descriptions(tmp_path, text, expected):
    assert expected in refusal(write_folder(tmp_path, text, r01=RUN))


def test_files_that_are_no_text(tmp_path):
    folder = good_folder(tmp_path)
    (folder / "r01.csv").write_bytes(b"\xff\xfe\x00t,x")
    assert "not UTF-8" in refusal(folder)
    (folder / "r01.csv").unlink()
    (folder / "r01.csv").mkdir()
    assert "cannot be read" in refusal(folder)


def test_a_constant_command_that_also_has_a_column(tmp_path):
    commands = {name: u for name, u in DESCRIPTION["commands"].items() if name != "block_angle"}
    folder = good_folder(tmp_path, commands=commands, constant_commands={"block_angle": 0.0})
    assert re.search("run r01, row 1, column block_angle.*constant_commands", refusal(folder))


@pytest.mark.parametrize(
    ("table", "changes", "expected"),
    [
        (TABLE.replace("a2", "a1"), {}, ["row 2", "column id", "'a1'"]),
        (TABLE.replace("a2", ""), {}, ["row 3", "column id", "empty"]),
        (TABLE.replace("0.06", "fast"), {}, ["row 3", "column surge_speed", "'fast'"]),
        (TABLE.replace(",20,1.0,0.06", ",200,1.0,0.06"), {}, ["row 3", "column tail_amplitude"]),
        (TABLE.replace(",20,1.0,0.06", ",,1.0,0.06"), {}, ["row 3", "column tail_amplitude"]),
        (TABLE.splitlines()[0], {}, ["0 rows"]),
        (TABLE, {"channels": {"surge_speed": "m"}}, ["key channels.surge_speed", "speed"]),
        (TABLE, {"channels": {"u": "m/s"}}, ["key channels.u", "unknown channel"]),
        (TABLE, {"channels": {"pitch": "deg"}}, ["row 1", "column pitch"]),
        (TABLE, {"constant_commands": None}, ["not declared: block_displacement, block_angle"]),
        (TABLE, {"constant_commands": {"block_angle": 40}}, ["constant_commands.block_angle"]),
        (TABLE, {"frame": None}, ["key frame"]),
        (TABLE, {"file": "other.csv"}, ["other.csv", "no such file"]),
        (TABLE, {"runs": DESCRIPTION["runs"]}, ["key runs", "unknown key"]),
        (TABLE.replace("yaw_rate", "turn_radius").replace("-1.0", "-0.3"),
         {"channels": {"turn_radius": "m"}}, ["row 2", "column turn_radius", "negative"]),
        (TABLE, {"channels": {"yaw_rate": "rad/s"}}, []),
    ],
)  # fmt: skip
def test_bad_tables(tmp_path, table, changes, expected):
    if not expected:
        table = table.replace("-1.0", "14.0")
        expected = ["column yaw_rate", "degrees"]
    message = refusal(steady_folder(tmp_path, table, **changes))
    for words in expected:
        assert words in message


def test_a_folder_with_two_tables_must_name_one(tmp_path):
    folder = write_folder(tmp_path, description(STEADY, file=None), one=TABLE)
    assert load_dataset(folder).ids == ("a1", "a2", "b1")
    write_folder(tmp_path, description(STEADY, file=None), two=TABLE)
    assert "2 CSV files" in refusal(folder)
