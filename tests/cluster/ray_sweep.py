"""A sweep that lost a node in mid-run equals trainings in one process, bit for bit."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from fish_env.cluster import ClusterSettings
from fish_env.errors import ConfigError
from robofish_agents.policies import read_policy
from robofish_agents.sweep.plan import plan
from robofish_agents.sweep.run import FINISHED, TABLE, run_sweep
from robofish_agents.training.run import POLICY, train
from tests.agents.test_training import Quiet
from tests.cluster.machines import KillOnce, machines

TINY = {
    "algorithm": "ppo",
    "task": "hold",
    "total_steps": 6144,
    "num_envs": 8,
    "ppo": {"n_steps": 16, "batch_size": 128, "n_epochs": 1},
    "evaluation": {"every": 1000, "episodes": 2},
    "checkpoint_every": 500,
}


def weights(folder: Path) -> list[bytes]:
    network = read_policy(folder / POLICY).network
    arrays = [network.mean, network.scale, *network.weights, *network.biases]
    return [np.ascontiguousarray(array).tobytes() for array in arrays]


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    file = tmp_path_factory.mktemp("config") / "tiny.yaml"
    file.write_text(yaml.safe_dump(TINY))
    return plan(file, "0,1", ["ppo.gamma=0.97,0.98"])


@pytest.fixture(scope="module")
def swept(trials, tmp_path_factory):
    out = tmp_path_factory.mktemp("swept")
    with machines() as cluster:
        kill = KillOnce(cluster)
        rows = run_sweep(trials, out, cluster.settings, kill)
    assert kill.calls >= 1
    return out, rows


def test_every_policy_equals_that_of_one_process(trials, swept, tmp_path):
    out, rows = swept
    assert [row["state"] for row in rows] == [FINISHED] * 4
    for trial in trials:
        train(trial.config, tmp_path / trial.name, Quiet())
        assert weights(out / trial.name) == weights(tmp_path / trial.name)
    first, second, *_ = trials
    assert weights(out / first.name) != weights(out / second.name), "they can be told apart"


def test_a_finished_sweep_is_not_done_again_and_needs_no_cluster(trials, swept):
    out, rows = swept
    files = [file for file in out.rglob("*") if file.is_file() and file.parent != out]
    before = {file: file.stat().st_mtime_ns for file in files}
    nowhere = ClusterSettings(address="127.0.0.1:1")
    again = run_sweep(trials, out, nowhere)
    assert [row["trial"] for row in again] == [row["trial"] for row in rows]
    assert {file: file.stat().st_mtime_ns for file in files} == before
    assert len((out / TABLE).read_text().splitlines()) == 5


def test_another_configuration_in_a_folder_is_refused(trials, swept):
    out, _ = swept
    (out / trials[0].name / "config.yaml").write_text("mine")
    with pytest.raises(ConfigError, match="another configuration"):
        run_sweep(trials, out, ClusterSettings())
    assert (out / trials[0].name / "config.yaml").read_text() == "mine"
