"""The measured robotic fish: the packaged steady table, and the runs outside the repository."""

import time

import numpy as np
import pytest

from fish_env.data import Dataset, SteadyDataset, load_dataset, unwrap_angle, write_dataset
from tests.fixtures.measured_data import measured_runs, steady_folder


def test_packaged_steady_table():
    table = load_dataset("msu-steady")
    assert isinstance(table, SteadyDataset)
    assert table.fish == "msu-tail-fish"
    assert table.notes == ()
    assert len(table.ids) == 29
    assert len(set(table.conditions)) == 15
    assert "MIT" in table.about["licence"]
    assert "DerivativeBasedKoopman" in table.about["source"]
    row = table.ids.index("A30_B+40_T2")
    np.testing.assert_allclose(table.commands[row], [np.radians(40), np.radians(30), 1, 0, 0])
    assert [values[row] for values in table.observations.values()] == [0.0773, 0.0152, -0.2462]


def test_steady_table_in_memory(tmp_path):
    table = load_dataset(steady_folder(tmp_path))
    assert table.ids == ("a1", "a2", "b1")
    assert table.conditions == ("A", "A", None)
    np.testing.assert_allclose(
        table.observations["yaw_rate"], np.radians([-1.0, np.nan, 12.0]), rtol=1e-14
    )
    unnamed = load_dataset(steady_folder(tmp_path, "tail_offset,tail_amplitude,tail_frequency,"
                                         "surge_speed,yaw_rate\n0,20,1,0.1,1\n"))  # fmt: skip
    assert (unnamed.ids, unnamed.conditions) == (("2",), (None,))


@pytest.mark.measured
def test_all_measured_runs_load_quickly(tmp_path):
    folder = measured_runs()
    began = time.process_time()
    dataset = load_dataset(folder)
    assert time.process_time() - began < 1.0
    assert isinstance(dataset, Dataset)
    assert len(dataset.runs) == 29
    assert dataset.notes == ()
    assert dataset.channels == ("x", "y", "yaw")
    assert all(run.commands.times_s.size == 1 for run in dataset.runs)
    assert load_dataset(write_dataset(dataset, tmp_path / "copy")) == dataset


@pytest.mark.measured
def test_steady_table_is_the_second_half_of_the_runs():
    runs, table = load_dataset(measured_runs()), load_dataset("msu-steady")
    for row, id in enumerate(table.ids):
        run = runs.run(id.replace("B-", "Bm").replace("B+", "Bp"))
        assert run.condition == table.conditions[row]
        np.testing.assert_allclose(table.commands[row], run.commands.values[0], atol=1e-6)
        surge, sway = second_half_speed(run)
        assert surge == pytest.approx(table.observations["surge_speed"][row], abs=0.005)
        assert sway == pytest.approx(table.observations["sway_speed"][row], abs=0.002)


def second_half_speed(run):
    time_s, yaw = run.time_s, run.channels["yaw"]
    north, east = (np.gradient(run.channels[name], time_s) for name in ("x", "y"))
    late = time_s >= 0.5 * (time_s[0] + time_s[-1])
    surge = north * np.cos(yaw) + east * np.sin(yaw)
    sway = east * np.cos(yaw) - north * np.sin(yaw)
    return surge[late].mean(), sway[late].mean()


def test_unwrap_bridges_gaps():
    true = np.linspace(0.0, 20.0, 60)
    wrapped = np.angle(np.exp(1j * true))
    wrapped[[5, 6, 30]] = np.nan
    unwrapped = unwrap_angle(wrapped)
    measured = np.isfinite(wrapped)
    np.testing.assert_allclose(unwrapped[measured], true[measured])
    assert np.isnan(unwrapped[~measured]).all()
