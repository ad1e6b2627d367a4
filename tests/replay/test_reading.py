"""What can be replayed, what is refused, and what is told about what was not measured."""

import numpy as np
import pandas as pd
import pytest

from fish_env.commands.simulate import pose_table, write_table
from fish_env.errors import DatasetError
from fish_env.replay.reading import read_replay_file, role_of
from fish_env.simulator import InitialState, Simulator, schedule
from tests.fixtures.measured_data import good_folder

COMMANDS = schedule([{"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 1.5, "tail_offset": 0.1}])


@pytest.fixture(scope="module")
def swim():
    start = InitialState(position=(0.5, -0.2, 1.0), tail_phase=0.7)
    return Simulator("zheng-2021-a").run(COMMANDS, 3.0, start, rate_hz=50.0)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_simulated_table_shows_the_simulated_pose(swim, tmp_path, ending):
    file = tmp_path / f"swim_baseline{ending}"
    write_table(pose_table(swim), file)
    motion = read_replay_file(file).motion
    assert motion.role == "baseline"
    assert motion.frames.position[-1] == pytest.approx(swim.states[-1, :3])
    assert abs(motion.frames.quaternion[-1] @ swim.states[-1, 3:7]) == pytest.approx(1.0)
    assert np.all(motion.frames.tail_angle == 0.0)
    assert "not in the file" in motion.notes[0]


def test_the_case_tells_how_the_tail_beats(swim, tmp_path):
    write_table(pose_table(swim), tmp_path / "swim.csv")
    motion = read_replay_file(tmp_path / "swim.csv", COMMANDS, 0.7).motion
    clock = motion.frames.start_s + motion.frames.step_s * np.arange(len(motion.frames.tail_angle))
    truth = 0.1 + 0.4 * np.sin(0.7 + 3.0 * np.pi * clock)
    assert motion.frames.tail_angle == pytest.approx(truth, abs=0.01)


def test_a_whole_trajectory_holds_its_own_tail(swim, tmp_path):
    swim.to_csv(tmp_path / "swim.csv")
    motion = read_replay_file(tmp_path / "swim.csv").motion
    assert np.ptp(motion.frames.tail_angle) == pytest.approx(0.8, abs=0.01)
    assert motion.channels["speed"][-1] == pytest.approx(np.linalg.norm(swim.states[-1, 7:10]))


def test_a_measured_run_says_what_is_drawn_but_was_not_measured(tmp_path):
    folder = good_folder(tmp_path / "data")
    read = read_replay_file(next(iter(sorted(folder.glob("*.csv")))))
    assert read.motion.role == "measured"
    assert read.fish is not None
    absent = {"roll", "pitch", "z"} - set(read.motion.channels)
    assert all(name in read.motion.notes[0] for name in absent)


def test_gaps_are_bridged_in_the_drawing_and_kept_in_the_plots(tmp_path):
    table = pd.DataFrame({"t": [0.0, 1.0, 2.0], "x": [0.0, None, 2.0], "yaw": [0.0, 0.1, 0.2]})
    table.to_csv(tmp_path / "gap.csv", index=False)
    motion = read_replay_file(tmp_path / "gap.csv").motion
    assert np.isfinite(motion.frames.position).all()
    assert np.isnan(motion.channels["x"][1])
    assert any("bridged" in note for note in motion.notes)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,x\n0,0\n1,one\n", "row 3, column x"),
        ("t,x\n0,0\n0,1\n", "row 3: t must increase"),
        ("time,x\n0,0\n1,1\n", "column t"),
        ("t,x\n0,\n1,\n", "no value at all in x"),
        ("t,qw,qx,qy,qz\n0,1,0,0,0\n1,2,0,0,0\n", "unit quaternions"),
        ("", "cannot be read"),
    ],
)
def test_a_bad_table_is_refused_with_its_place(tmp_path, text, said):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(DatasetError, match=said):
        read_replay_file(tmp_path / "bad.csv")


def test_other_files_are_refused(tmp_path):
    (tmp_path / "swim.txt").write_text("t,x\n0,0\n1,1\n")
    with pytest.raises(DatasetError, match=r"not '\.txt'"):
        read_replay_file(tmp_path / "swim.txt")
    with pytest.raises(DatasetError, match="no such file"):
        read_replay_file(tmp_path / "none.csv")


def test_the_last_word_of_a_name_is_its_role():
    assert role_of("r07_measured") == "measured"
    assert role_of("pool-extended") == "extended"
    assert role_of("extended_pool") == "other"
