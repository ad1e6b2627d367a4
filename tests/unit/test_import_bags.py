"""ROS bags written by `rosbags` become datasets whose values are those that were recorded."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from fish_env.data import Dataset, load_dataset
from fish_env.data.importing import assemble, guess_mapping, open_logs, parse_plan
from fish_env.data.importing.bag_checks import check_types
from fish_env.errors import DatasetError
from tests.command_line import run
from tests.fixtures.foreign_logs import Swim, swim, write_odometry, write_ros1, write_ros2

COMMON = ("--fish", "zheng-2021-a", "--yes")


@pytest.fixture(scope="module")
def motion() -> Swim:
    return swim()


def record(folder: Path, kind: str, motion: Swim, name: str = "swim") -> Path:
    if kind == "ros1":
        return write_ros1(folder / f"{name}.bag", motion)
    plugin, _, servo = kind.partition("-")
    return write_ros2(folder / name, motion, plugin, servo or "topics")


POSE = {"x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r"}


def check_truth(
    dataset: object, motion: Swim, id: str = "swim", channels: set[str] = POSE, imu_delay=0.01
) -> None:
    """The dataset holds what was recorded, though in another frame and on three clocks."""
    assert isinstance(dataset, Dataset)
    measured = dataset.run(id)
    assert set(measured.channels) == channels
    for name in measured.channels:
        truth = motion.channels[name]
        present = np.isfinite(measured.channels[name])
        delay = imu_delay if name in "pqr" else 0.0
        # Recorded times are whole nanoseconds since 1970.
        np.testing.assert_allclose(measured.time_s[present], motion.time_s + delay, atol=1e-9)
        np.testing.assert_allclose(measured.channels[name][present], truth, atol=1e-12)
    np.testing.assert_allclose(measured.commands.times_s, motion.command_times_s, atol=1e-9)
    np.testing.assert_allclose(measured.commands.values, motion.commands, atol=1e-12)


@pytest.mark.parametrize("kind", ["SQLITE3", "MCAP", "MCAP-message", "SQLITE3-message", "ros1"])
def test_a_bag_becomes_a_dataset_with_the_true_values(tmp_path, capsys, motion, kind):
    bag = record(tmp_path, kind, motion)
    out = tmp_path / "trials"
    status, shown, err = run(capsys, "import", str(bag), "--out", str(out), *COMMON)
    assert (status, err) == (0, "")
    check_truth(load_dataset(out), motion)
    assert (out / "import-swim.png").stat().st_size > 20_000
    for words in ("frame enu", "REP 103", "between: hold", "orientation.x", "held at 0"):
        assert words in " ".join(shown.split())


ARRAY = """\
format: robofish-import/1
name: pool
fish: zheng-2021-a
frame: enu
sources:
  pose: {part: /fish/pose, time: {column: header.stamp, unit: ns}}
  servo: {part: /servo/command, time: {column: recorded, unit: ns}}
channels:
  x: {source: pose, column: pose.position.x, unit: m}
commands:
  tail_offset: {source: servo, column: "data[0]", unit: rad, sign: -1}
  tail_amplitude: {source: servo, column: "data[1]", unit: rad}
  tail_frequency: {source: servo, column: "data[2]", unit: hz}
constant_commands: {block_displacement: 0, block_angle: 0}
"""


def test_elements_without_names_are_mapped_by_hand(tmp_path, capsys, motion):
    bag, out = record(tmp_path, "MCAP-array", motion), tmp_path / "trials"
    status, shown, err = run(capsys, "import", str(bag), "--out", str(out), *COMMON)
    assert status == 2
    assert "not declared: tail_offset, tail_amplitude, tail_frequency" in err
    assert "data[0], data[1], data[2]" in " ".join(shown.split())
    (tmp_path / "m.yaml").write_text(ARRAY)
    mapping = ("--mapping", str(tmp_path / "m.yaml"))
    status, _, err = run(capsys, "import", str(bag), "--out", str(tmp_path / "o"), *mapping)
    assert (status, err) == (0, "")
    check_truth(load_dataset(tmp_path / "o"), motion, channels={"y"})


def test_odometry_has_velocities_of_the_body_and_joints_have_names(tmp_path, motion):
    (tmp_path / "swim").parent.mkdir(exist_ok=True)
    sources, _ = open_logs([write_odometry(tmp_path / "swim", motion)])
    guess = guess_mapping(sources, "pool", "zheng-2021-a")
    assert guess.content["channels"]["tail_angle"]["column"] == "position[tail_joint]"
    constants = {"tail_offset": 0, "tail_amplitude": 0.3, "tail_frequency": 1}
    constants |= guess.content["constant_commands"]
    content = {**guess.content, "constant_commands": constants}
    dataset = assemble(parse_plan(content, tmp_path), sources, tmp_path).dataset
    still = replace(
        motion, command_times_s=np.zeros(1), commands=np.array([[0.0, 0.3, 1.0, 0.0, 0.0]])
    )
    check_truth(dataset, still, channels=set(motion.channels), imu_delay=0.0)


def test_compare_accepts_it(tmp_path, capsys, motion):
    bag, out = record(tmp_path, "SQLITE3", motion), tmp_path / "trials"
    run(capsys, "import", str(bag), "--out", str(out), *COMMON)
    numbers = tmp_path / "numbers.json"
    status, shown, err = run(capsys, "compare", str(out), "--json", str(numbers))
    assert (status, err) == (0, "")
    errors = json.loads(numbers.read_text())["runs"][0]["errors"]
    # What was recorded is what is simulated; only the start has to be estimated.
    assert errors["yaw"]["rmse"] < 0.05
    assert "follow a gap" not in shown


def test_the_written_mapping_imports_another_bag(tmp_path, capsys, motion):
    bag, other = record(tmp_path, "MCAP", motion), record(tmp_path, "MCAP", swim(1), "later")
    first, second = tmp_path / "first", tmp_path / "second"
    run(capsys, "import", str(bag), "--out", str(first), *COMMON)
    mapping = str(first / "import.yaml")
    status, _, err = run(
        capsys, "import", str(bag), str(other), "--out", str(second), "--mapping", mapping
    )
    assert (status, err) == (0, "")
    dataset = load_dataset(second)
    check_truth(dataset, motion)
    check_truth(dataset, swim(1), "later")
    assert (second / "import.yaml").read_text() == (first / "import.yaml").read_text()


def test_the_dataset_is_one_a_person_can_read(tmp_path, capsys, motion):
    bag, out = record(tmp_path, "MCAP-message", motion), tmp_path / "trials"
    run(capsys, "import", str(bag), "--out", str(out), *COMMON)
    text = (out / "dataset.yaml").read_text()
    assert "commands: {tail_offset: deg, tail_amplitude: deg, tail_frequency: Hz}" in text
    assert yaml.safe_load(text)["frame"] == "enu"
    assert max(map(len, text.splitlines())) <= 100


def test_without_anybody_to_confirm_nothing_is_written(tmp_path, capsys, motion):
    bag, out = record(tmp_path, "SQLITE3", motion), tmp_path / "trials"
    status, shown, err = run(
        capsys, "import", str(bag), "--out", str(out), "--fish", "zheng-2021-a"
    )
    assert status == 2
    assert "--yes" in err
    assert "Assumed" in shown
    assert not (out / "dataset.yaml").exists()


def test_a_file_that_is_no_bag_is_refused_in_one_line(tmp_path, capsys, motion):
    whole = record(tmp_path, "ros1", motion).read_bytes()
    for name, content in (("cut.bag", whole[:5000]), ("a.mcap", b"no"), ("b.db3", b"SQLite")):
        (tmp_path / name).write_bytes(content)
        status, _, err = run(
            capsys, "import", str(tmp_path / name), "--out", str(tmp_path / "o"), *COMMON
        )
        assert status == 2
        assert name in err
        assert "cannot be read as a ROS bag" in err
        assert err.count("\n") == 1


@pytest.mark.parametrize(
    "types",
    [
        {"a/msg/B": ([], [("x: int = __import__('os')", (1, ("float64", 0)))])},
        {"a/msg/B\n": ([], [])},
        {"a/msg/B": ([], [("x", (2, 'b")\nprint("c'))])},
        {"a/msg/B": ([], [("x", (4, ((2, "b.c"), 0)))])},
        {"a/msg/B": ([("C()", "int8", 1)], [])},
        {"a/msg/B": ([], [("x", (3, ((2, "a/msg/C"), 10**9)))])},
    ],
)
def test_definitions_that_could_become_code_are_refused(types, tmp_path):
    with pytest.raises(DatasetError, match=r"swim\.mcap"):
        check_types(tmp_path / "swim.mcap", types)
    check_types(tmp_path / "swim.mcap", {"a/msg/B": ([], [("x", (1, ("float64", 0)))])})


def test_definitions_are_checked_before_rosbags_makes_functions_of_them(
    tmp_path, capsys, motion, monkeypatch
):
    """Even if its parser let something through that is no name."""
    import rosbags.typesys

    bag, evil = record(tmp_path, "MCAP", motion), f"x; open(r'{tmp_path}/ran', 'w')"
    fields = {"geometry_msgs/msg/PoseStamped": ([], [(evil, (1, ("float64", 0)))])}
    monkeypatch.setattr(rosbags.typesys, "get_types_from_msg", lambda text, name: fields)
    status, _, err = run(capsys, "import", str(bag), "--out", str(tmp_path / "o"), *COMMON)
    assert status == 2
    assert "as a name" in err
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "definition",
    [
        "float64 x\n__import__('pathlib').Path('{run}').touch()",
        "float64 x = __import__('pathlib').Path('{run}').touch()",
        'string X=\'"""\n__import__("pathlib").Path("{run}").touch()\'',
        "float64[__import__('pathlib').Path('{run}').touch()] x",
    ],
)
def test_code_in_a_bag_is_not_run(tmp_path, capsys, definition):
    from rosbags.rosbag2 import StoragePlugin, Writer

    text = definition.replace("{run}", str(tmp_path / "ran"))
    with Writer(tmp_path / "b", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/x", "a/msg/B", msgdef=text, rihs01="RIHS01_0")
        writer.write(topic, 0, b"\0\1\0\0" + bytes(8))
    out = str(tmp_path / "o")
    status, _, err = run(capsys, "import", str(tmp_path / "b"), "--out", out, *COMMON)
    assert status == 2
    assert err.count("\n") == 1
    assert not (tmp_path / "ran").exists()


def test_a_bag_is_read_without_being_changed(tmp_path, motion):
    bag = record(tmp_path, "SQLITE3", motion)
    before = {file.name: (file.read_bytes(), file.stat().st_mtime_ns) for file in bag.iterdir()}
    sources, notes = open_logs([bag])
    assert {source.part for source in sources} >= {"/fish/pose", "/imu"}
    assert before == {f.name: (f.read_bytes(), f.stat().st_mtime_ns) for f in bag.iterdir()}
    assert notes == ("swim: /camera left out: its messages are lists of 1200 elements",)
