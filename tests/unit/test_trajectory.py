"""A simulated motion as labelled columns, and in files."""

import numpy as np
import pandas as pd
import pytest

from fish_env.errors import ScheduleError
from fish_env.model.frames import euler_from_quaternion
from fish_env.simulator import InitialState, Simulator
from fish_env.trajectory import POSE_COLUMNS
from tests.physics.cases import SWIM, TUMBLE


@pytest.fixture(scope="module")
def run():
    return Simulator("zheng-2021-a").run(SWIM, duration_s=1.0, initial=TUMBLE)


def test_columns_are_named_and_in_order(run):
    assert len(run) == 11
    assert list(run.columns)[:14] == ["t", *POSE_COLUMNS]
    np.testing.assert_array_equal(run["u"], run.states[:, 7])
    np.testing.assert_array_equal(run["tail_amplitude"], 0.35)
    euler = euler_from_quaternion(run.states[:, 3:7])
    np.testing.assert_array_equal(run["roll"], euler[:, 0])
    np.testing.assert_array_equal(run["pitch"], euler[:, 1])


def test_yaw_is_unwrapped():
    """A spinning fish passes south without a jump."""
    start = InitialState(euler=(0.0, 0.0, 3.0), angular_velocity_body=(0.0, 0.0, 3.0))
    run = Simulator("zheng-2021-a").run([{"t": 0.0}], duration_s=2.0, initial=start)
    assert run["yaw"][0] == pytest.approx(3.0)
    assert run["yaw"][-1] > np.pi
    assert np.all(np.abs(np.diff(run["yaw"])) < 1.0)


def test_an_unknown_column_lists_the_known_ones(run):
    with pytest.raises(KeyError, match=r"'depth' is not a column.*tail_phase"):
        run["depth"]


def test_a_data_frame_holds_every_column(run):
    frame = run.to_pandas()
    assert list(frame) == list(run.columns)
    np.testing.assert_array_equal(frame["z"], run["z"])


def test_csv_reads_back_to_the_last_bit(run, tmp_path):
    run.to_csv(tmp_path / "run.csv")
    header, *rows = (tmp_path / "run.csv").read_text().splitlines()
    assert header.split(",") == list(run.columns)
    table = np.array([row.split(",") for row in rows], float)
    np.testing.assert_array_equal(table, np.column_stack(list(run.columns.values())))


def test_csv_can_hold_chosen_columns(run, tmp_path):
    run.to_csv(tmp_path / "run.csv", ("t", "z"))
    assert (tmp_path / "run.csv").read_text().startswith("t,z\n0,1\n")
    with pytest.raises(ScheduleError, match="no columns \\['depth'\\]"):
        run.to_csv(tmp_path / "run.csv", ("t", "depth"))


def test_parquet_reads_back_to_the_last_bit(run, tmp_path):
    pytest.importorskip("pyarrow")
    run.to_parquet(tmp_path / "run.parquet")
    frame = pd.read_parquet(tmp_path / "run.parquet")
    for name, values in run.columns.items():
        np.testing.assert_array_equal(frame[name], values)
