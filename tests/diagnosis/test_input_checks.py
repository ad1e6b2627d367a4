"""Data that would mislead a diagnosis are refused by name; merely poor data are not."""

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run, write_dataset
from fish_env.diagnosis.input_checks import check_runs, load_runs
from fish_env.diagnosis.pipeline import diagnose
from fish_env.errors import DatasetError
from tests.fixtures.measured_data import steady_folder

COMMANDS = CommandSteps(np.zeros(1), np.array([[0.0, 0.4, 1.0, 0.0, 0.0]]))


def run(name="r01", samples=250, seed=0, **changes):
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / 25.0
    channels = {n: 0.3 * np.sin(time + i) + rng.normal(0, 1e-3, samples)
                for i, n in enumerate(("x", "y", "z", "yaw"))}  # fmt: skip
    channels |= changes.pop("channels", {})
    return Run(name, changes.pop("time_s", time), channels, COMMANDS, "rest", 0.0, **changes)


def pool(*runs):
    return Dataset("pool", "zheng-2021-a", runs)


GOOD = pool(run(), run("r02", seed=1))


def with_missing(share):
    values = run().channels["yaw"].copy()
    values[np.random.default_rng(3).random(250) < share] = np.nan
    return pool(run(channels={"yaw": values}), run("r02", seed=1))


def test_good_runs_pass():
    check_runs(GOOD)


def test_missing_samples_pass():
    check_runs(with_missing(0.3))


JUMP = np.arange(250) / 25.0 + np.where(np.arange(250) < 100, 0.0, 60.0)
REFUSED = {
    "zeros": (pool(run(channels={"y": np.zeros(250)})), "run r01: y is 0 in every sample"),
    "constant": (pool(run("r07", channels={"yaw": np.full(250, 0.7)})), "run r07: yaw is 0.7"),
    "duplicated": (pool(run(), run("r02")), "r01 and r02 have the same samples"),
    "short": (pool(run(), run("r02", samples=20, seed=1)), "run r02: lasts 0.76 s, less than"),
    "clock": (pool(run(time_s=JUMP)), "the clock jumps by 60.04 s at t = 3.96 s"),
    "few": (pool(run(samples=40)), "40 samples of x in all"),
    "channel": (
        Dataset("pool", "zheng-2021-a", (
            Run("r01", run().time_s, {"tail_angle": run().channels["x"]}, COMMANDS, "rest"),
        )),
        "measures only tail_angle",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_misleading_runs_are_refused(name):
    dataset, words = REFUSED[name]
    with pytest.raises(DatasetError, match=words):
        check_runs(dataset)


def test_a_refusal_reaches_the_caller_and_writes_nothing(tmp_path):
    write_dataset(REFUSED["duplicated"][0], tmp_path / "pool")
    with pytest.raises(DatasetError, match="the same samples"):
        diagnose(tmp_path / "pool", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_table_of_steady_motion_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="steady"):
        load_runs(steady_folder(tmp_path))
