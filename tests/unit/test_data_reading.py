"""What a well-formed dataset of runs reads as."""

import math
from pathlib import Path

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run, list_datasets, load_dataset
from fish_env.data.schema import identical_runs
from fish_env.errors import DatasetError
from tests.fixtures.measured_data import DESCRIPTION, RUN, description, good_folder, write_folder


def load_runs(folder: Path) -> Dataset:
    dataset = load_dataset(folder)
    assert isinstance(dataset, Dataset)
    return dataset


def test_channels_gaps_and_start(tmp_path):
    dataset = load_runs(good_folder(tmp_path))
    run = dataset.run("r01")
    assert dataset.channels == ("x", "z", "yaw")
    assert dataset.notes == ()
    np.testing.assert_array_equal(run.time_s, [0.0, 0.1, 0.25, 0.3])
    np.testing.assert_array_equal(run.channels["z"], [0.5, np.nan, 0.52, 0.53])
    assert (run.start, run.tail_phase, run.condition) == ("rest", 0.0, None)


def test_commands_are_merged_into_switch_times(tmp_path):
    commands = load_runs(good_folder(tmp_path)).runs[0].commands
    np.testing.assert_array_equal(commands.times_s, [0.0, 0.25, 0.3])
    np.testing.assert_array_equal(commands.values[:, 2], [1.0, 2.0, 2.0])
    np.testing.assert_array_equal(commands.values[:, 3], [0.0, 0.0, 0.01])
    np.testing.assert_array_equal(commands.at([-1.0, 0.2, 0.25, 9.0])[:, 2], [1.0, 1.0, 2.0, 2.0])


@pytest.mark.parametrize(
    ("channel", "unit", "factor"),
    [
        ("x", "m", 1.0),
        ("x", "cm", 0.01),
        ("x", "mm", 0.001),
        ("pitch", "deg", math.pi / 180.0),
        ("u", "cm/s", 0.01),
        ("u", "mm/s", 0.001),
        ("r", "deg/s", math.pi / 180.0),
        ("tail_angle", "deg", math.pi / 180.0),
    ],
)
def test_units_are_converted(tmp_path, channel, unit, factor):
    run = RUN.replace("t,x,z,yaw", f"t,{channel},b,c")
    folder = good_folder(tmp_path, run, channels={channel: unit}, noise={channel: 0.5})
    dataset = load_runs(folder)
    np.testing.assert_allclose(
        dataset.runs[0].channels[channel], factor * np.array([0.0, 0.01, 0.02, 0.03]), rtol=1e-14
    )
    assert dataset.noise[channel] == pytest.approx(0.5 * factor)


def test_command_units_are_converted(tmp_path):
    commands = DESCRIPTION["commands"] | {"tail_offset": "deg", "block_displacement": "mm"}
    run = load_runs(good_folder(tmp_path, commands=commands)).runs[0]
    assert run.commands.values[0, 0] == pytest.approx(math.radians(0.2))
    assert run.commands.values[-1, 3] == pytest.approx(1e-5)


def test_constant_commands_stand_in_for_columns(tmp_path):
    run = RUN.replace("block_displacement,block_angle", "a,b")
    commands = {name: unit for name, unit in DESCRIPTION["commands"].items() if "block" not in name}
    constants = {"block_displacement": -0.01, "block_angle": 0.3}
    folder = good_folder(tmp_path, run, commands=commands, constant_commands=constants)
    dataset = load_runs(folder)
    np.testing.assert_array_equal(dataset.runs[0].commands.values[0, 3:], [-0.01, 0.3])


def test_undeclared_columns_and_unlisted_files_are_noted(tmp_path):
    folder = good_folder(tmp_path, channels={"x": "m", "yaw": "rad"})
    (folder / "r02.csv").write_text(RUN)
    notes = load_dataset(folder).notes
    assert len(notes) == 2
    assert "r02.csv" in notes[0]
    assert all(word in notes[1] for word in ("r01.csv", "run r01", "column z", "ignored"))


def test_a_command_that_changes_after_a_gap_is_noted(tmp_path):
    rows = [f"{t / 10},0.{t},0.5,0.1,0.2,0.3,{1 + (t > 6)}.0,0.0,0.0" for t in range(12)]
    header = RUN.splitlines()[0]
    whole = "\n".join([header, *rows]) + "\n"
    assert load_runs(good_folder(tmp_path, whole)).notes == ()
    lost = "\n".join([header, *rows[:6], *rows[8:]]) + "\n"
    (note,) = load_runs(good_folder(tmp_path, lost)).notes
    assert "1 of 1 changes of command follow a gap" in note
    # A row with nothing but the command was added for it, and tells its very time.
    alone = rows[7].replace("0.7,0.7,0.5,0.1", "0.68,,,")
    added = "\n".join([header, *rows[:6], alone, *rows[8:]]) + "\n"
    assert load_runs(good_folder(tmp_path, added)).notes == ()


def test_runs_that_were_copied_cut_or_moved_in_time_are_found():
    rng = np.random.default_rng(0)
    time, values = np.arange(100) / 10.0, rng.normal(0.0, 1.0, (3, 100))
    steps = CommandSteps(np.zeros(1), np.zeros((1, 5)))

    def run(id, x, y, t=time):
        return Run(id, t, {"x": x, "y": y}, CommandSteps(t[:1], steps.values), "rest", 0.0)

    first = run("a", values[0], values[1])
    assert identical_runs((first, run("b", values[0], values[1], time + 7.0))) == (("a", "b"),)
    cut = run("b", values[0, 30:60], values[1, 30:60], time[:30])
    assert identical_runs((first, cut)) == (("a", "b"),)
    assert identical_runs((first, run("b", values[0], values[2]))) == ()


def test_a_rest_that_two_runs_share_is_no_copy():
    time = np.arange(100) / 10.0
    steps = CommandSteps(np.zeros(1), np.zeros((1, 5)))
    runs = []
    for speed in (0.1, 0.2):
        x = np.maximum(time - 5.0, 0.0) * speed
        runs.append(Run(f"r{speed}", time, {"x": x}, steps, "rest", 0.0))
    assert identical_runs(tuple(runs[i] for i in (0, 1))) == ()


def test_identical_runs_are_noted(tmp_path):
    runs = [
        {"id": name, "file": f"{name}.csv", "start": "rest", "tail_phase": "unknown"}
        for name in ("a", "b")
    ]
    folder = write_folder(tmp_path, description(runs=runs), a=RUN, b=RUN)
    assert "runs a and b hold the same samples" in load_dataset(folder).notes[0]


def test_depth_alone_is_read_as_z(tmp_path):
    folder = good_folder(
        tmp_path, RUN.replace(",z,", ",depth,"), channels={"depth": "cm"}, noise={"depth": 1.0}
    )
    dataset = load_runs(folder)
    assert dataset.channels == ("z",)
    assert dataset.noise == {"z": 0.01}
    np.testing.assert_allclose(dataset.runs[0].channels["z"][0], 0.005)


def test_depth_beside_z_fills_its_gaps(tmp_path):
    run = RUN.replace("t,x,z", "t,depth,z").replace("0.1,0.01,,", "0.1,0.51,,")
    run = run.replace("0.0,0.0,0.5,", "0.0,0.49,0.5,").replace("0.25,0.02", "0.25,0.53")
    run = run.replace("0.3,0.03,", "0.3,,")
    folder = good_folder(tmp_path, run, channels={"depth": "m", "z": "m"})
    dataset = load_runs(folder)
    np.testing.assert_array_equal(dataset.runs[0].channels["z"], [0.5, 0.51, 0.52, 0.53])
    assert "depth fills 1 gaps" in dataset.notes[-1]


def test_quaternion_is_read_as_angles(tmp_path):
    # Yaw 90 degrees, then pitch up 30 degrees at yaw 0, then a gap.
    half = math.radians(15.0)
    run = (
        "t,qw,qx,qy,qz\n"
        f"0,{math.sqrt(0.5)},0,0,{math.sqrt(0.5)}\n"
        f"1,{math.cos(half)},0,{math.sin(half)},0\n"
        "2,,,,\n"
    )
    folder = good_folder(
        tmp_path,
        run,
        channels=dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
        commands={},
        constant_commands=dict.fromkeys(DESCRIPTION["commands"], 0.0),
        noise={"yaw": 0.01},
    )
    dataset = load_runs(folder)
    assert dataset.channels == ("roll", "pitch", "yaw")
    channels = dataset.runs[0].channels
    np.testing.assert_allclose(channels["yaw"], [math.pi / 2, 0.0, np.nan], atol=1e-12)
    np.testing.assert_allclose(channels["pitch"], [0.0, math.radians(30.0), np.nan], atol=1e-12)
    np.testing.assert_allclose(channels["roll"], [0.0, 0.0, np.nan], atol=1e-12)


@pytest.mark.parametrize("yaw", ["winding", "wrapped", "noisy at the seam"])
def test_a_real_yaw_is_not_taken_for_degrees(tmp_path, yaw):
    time = np.arange(0.0, 60.0, 0.02)
    angle = 1.5 * time if yaw == "winding" else np.full(time.shape, math.pi)
    angle = angle + 0.1 * np.sin(2.0 * math.pi * 3.0 * time)
    angle += np.random.default_rng(1).normal(0.0, 0.02, time.shape)
    if yaw != "winding":
        angle = np.angle(np.exp(1j * (angle + (0.8 * time if yaw == "wrapped" else 0.0))))
    rows = "".join(f"{t!r},{a!r}\n" for t, a in zip(time.tolist(), angle.tolist(), strict=True))
    folder = good_folder(
        tmp_path,
        "t,yaw\n" + rows,
        channels={"yaw": "rad"},
        commands={},
        constant_commands=dict.fromkeys(DESCRIPTION["commands"], 0.0),
    )
    np.testing.assert_array_equal(load_runs(folder).runs[0].channels["yaw"], angle)


def test_a_fish_file_beside_the_description(tmp_path):
    (tmp_path / "mine.yaml").write_text("base: zheng-2021-a\nname: mine\n")
    dataset = load_dataset(good_folder(tmp_path, fish="mine.yaml"))
    assert dataset.fish == str((tmp_path / "mine.yaml").resolve())


def test_spreadsheet_habits_are_understood(tmp_path):
    # A byte-order mark, carriage returns, blanks after commas, NaN for a gap, blank last lines.
    run = "\ufeff" + RUN.replace(",", ", ").replace("0.14", "nan") + "\n\n"
    run = run.replace("\n", "\r\n")
    dataset = load_runs(good_folder(tmp_path, run))
    np.testing.assert_array_equal(dataset.runs[0].channels["yaw"], [0.1, 0.12, np.nan, np.nan])


def test_ids_are_kept_as_written(tmp_path):
    runs = "runs: [{id: 007, file: r01.csv, start: rest, tail_phase: 1e-1, condition: 1_0}]"
    good_folder(tmp_path)
    text = (tmp_path / "dataset.yaml").read_text()
    (tmp_path / "dataset.yaml").write_text(text[: text.index("runs:")] + runs)
    run = load_runs(tmp_path).runs[0]
    assert (run.id, run.tail_phase, run.condition) == ("007", 0.1, "1_0")


def test_found_by_folder_file_or_name(tmp_path):
    folder = good_folder(tmp_path)
    assert load_dataset(str(folder)) == load_dataset(folder / "dataset.yaml")
    assert "msu-steady" in list_datasets()
    assert load_dataset("msu-steady").name == "msu-steady"
    with pytest.raises(DatasetError, match="msu-steady"):
        load_dataset("msu-stedy")
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match=r"no dataset\.yaml.*robofish import \S*empty --out"):
        load_dataset(tmp_path / "empty")


def test_a_log_is_to_be_imported_first(tmp_path):
    log = tmp_path / "my log.csv"
    log.write_text("t,x\n0,0\n", encoding="utf-8")
    with pytest.raises(DatasetError, match=r"no dataset\.yaml.* import '.*my log.csv' --out"):
        load_dataset(log)
