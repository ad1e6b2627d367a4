"""Folders of results that come from someone else, or hold what the user wrote, lose nothing."""

import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from fish_env.analysis.results import DiagnoseResult
from fish_env.campaign import Options, find_cases, run_campaign
from fish_env.campaign.cases import prepare
from fish_env.campaign.run import MARK, TABLE
from fish_env.cluster import ClusterSettings
from fish_env.commands.plot import plot_fish
from fish_env.data import load_dataset, write_dataset
from fish_env.diagnosis import diagnose
from fish_env.diagnosis.written import LIST, replace_part
from fish_env.errors import ConfigError, DatasetError, OutputError, RoboticFishError
from fish_env.simulator import Simulator
from robofish_agents.sweep.plan import plan
from robofish_agents.sweep.run import PLAN, run_sweep
from robofish_agents.sweep.run import TABLE as SWEEP_TABLE
from robofish_agents.training.config import Ppo, TrainConfig
from robofish_agents.training.lock import LOCK, locked
from robofish_agents.training.plain import read_plain, write_plain
from robofish_agents.training.run import CONFIG, config_bytes, train
from tests.agents.test_training import Quiet
from tests.command_line import run
from tests.fixtures.measured_data import good_folder

TINY = TrainConfig(
    "tiny", "ppo", "hold", 256, num_envs=8, ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1)
)
CLUSTER = ClusterSettings(None, 1, None)


@pytest.fixture
def mine(tmp_path) -> Path:
    (tmp_path / "mine").write_text("of the user")
    return tmp_path / "mine"


def campaign(data: Path, out: Path) -> None:
    run_campaign(find_cases([str(data)]), out, Options(), CLUSTER)


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_a_lock_that_is_another_file_is_not_emptied(link, mine, tmp_path):
    (tmp_path / "run").mkdir()
    link(mine, tmp_path / "run" / LOCK)
    with pytest.raises(RoboticFishError, match=r"training\.lock"), locked(tmp_path / "run"):
        pass
    assert mine.read_text() == "of the user"


def test_a_lock_that_the_user_wrote_is_kept(tmp_path):
    (tmp_path / LOCK).write_text("locked by me")
    with pytest.raises(ConfigError, match="is no lock"), locked(tmp_path):
        pass
    assert (tmp_path / LOCK).read_text() == "locked by me"


@pytest.mark.parametrize("name", ["checkpoint.zip", "policy.npz", "evaluations.csv", "card.yaml"])
def test_a_training_writes_through_no_link(name, mine, tmp_path):
    """The folder has the configuration of this training, so it would go on there."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / CONFIG).write_bytes(config_bytes(TINY))
    (folder / name).symlink_to(mine)
    with pytest.raises(OutputError, match="is a link"):
        train(TINY, folder, Quiet(), resume=name == "checkpoint.zip")
    assert mine.read_text() == "of the user"


@pytest.mark.parametrize("name", ["report.html", "diagnosis.json", "extended.yaml"])
def test_a_diagnosis_writes_through_no_link(name, mine, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).symlink_to(mine)
    with pytest.raises(OutputError, match=rf"{name}: is a link"):
        diagnose(good_folder(tmp_path / "data"), folder)
    assert mine.read_text() == "of the user"


@pytest.mark.parametrize(
    "name",
    [
        "report.html", "diagnosis.json", "extended.yaml", "next_experiment.csv",
        "figures/gain.svg", "figures/run_r01.png",
    ],
)  # fmt: skip
def test_a_diagnosis_does_not_replace_a_file_of_the_user(name, tmp_path):
    file = tmp_path / "out" / name
    file.parent.mkdir(parents=True)
    file.write_text("of the user")
    with pytest.raises(OutputError, match=rf"{file.name}: this program did not write it"):
        diagnose(good_folder(tmp_path / "data"), tmp_path / "out")
    assert file.read_text() == "of the user"


def test_a_campaign_does_not_replace_a_run(tmp_path):
    data = good_folder(tmp_path / "data", runs=[{"id": "a", "file": TABLE, "start": "rest"}])
    (data / "r01.csv").rename(data / TABLE)
    before = (data / TABLE).read_text()
    with pytest.raises(OutputError):
        campaign(data, data)
    assert (data / TABLE).read_text() == before


def test_a_campaign_does_not_replace_a_table_of_the_user(tmp_path):
    data = good_folder(tmp_path / "data")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / TABLE).write_text("robot,cost\n1,500\n")
    with pytest.raises(OutputError, match="did not write it"):
        campaign(data, tmp_path / "out")
    assert (tmp_path / "out" / TABLE).read_text() == "robot,cost\n1,500\n"


ROW = {"name": "data", "source": "x", "state": "finished", "verdict": "v", "causes": "",
       "runtime_s": 1.0, "reason": ""}  # fmt: skip


@pytest.mark.parametrize(
    "mark",
    [
        "[]", "{}", '{"row": 5}', "[" * 5000, json.dumps({"row": ROW}),
        json.dumps({"row": ROW | {"runtime_s": "x"}, "digest": "DIGEST"}),
        json.dumps({"row": ROW | {"verdict": {"a": 1}}, "digest": "DIGEST"}),
        json.dumps({"row": ROW, "digest": [1]}),
    ],
    ids=range(8),
)  # fmt: skip
def test_a_forged_mark_of_a_case_is_refused(mark, tmp_path):
    data, out = good_folder(tmp_path / "data"), tmp_path / "out"
    (case,) = find_cases([str(data)])
    digest = prepare(case, Options(), out / case.name).digest
    (out / case.name).mkdir(parents=True)
    (out / case.name / MARK).write_text(mark.replace("DIGEST", digest))
    with pytest.raises(OutputError, match="data"):
        campaign(data, out)


def test_a_sweep_does_not_replace_its_configuration(tmp_path, capsys):
    config = tmp_path / PLAN
    shipped = Path(__file__).resolve().parents[2] / "configs" / "train" / "ppo-hold.yaml"
    text = shipped.read_text()
    config.write_text(text)
    status, _, error = run(capsys, "sweep", str(config), "--out", str(tmp_path))
    assert status == 2
    assert "is read" in error
    assert config.read_text() == text


@pytest.mark.parametrize("name", [PLAN, SWEEP_TABLE])
def test_a_sweep_does_not_replace_a_file_of_the_user(name, tmp_path):
    (tmp_path / name).write_text("notes: about my sweep\n")
    with pytest.raises(OutputError, match="did not write it"):
        run_sweep(plan("ppo-hold"), tmp_path, CLUSTER)
    assert (tmp_path / name).read_text() == "notes: about my sweep\n"


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "steps\nx\n", "steps\n1,2\n", 'steps\n"', "\0"])
def test_damaged_evaluations_are_refused_or_trained_again(text, tmp_path, monkeypatch):
    trials = plan("ppo-hold")
    monkeypatch.setattr("robofish_agents.sweep.run.connected", no_cluster)
    folder = tmp_path / trials[0].name
    folder.mkdir()
    (folder / "evaluations.csv").write_text(text)
    if text in ("", "\0"):
        with pytest.raises(ConfigError, match="no cluster"):
            run_sweep(trials, tmp_path, CLUSTER)
        return
    with pytest.raises(ConfigError, match=r"evaluations\.csv"):
        run_sweep(trials, tmp_path, CLUSTER)


def no_cluster(settings):
    raise ConfigError("no cluster")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"figures": ' + "9" * 5000 + "}", "\udcff"])
def test_a_hostile_list_of_files_counts_as_none(text, tmp_path):
    (tmp_path / LIST).write_text(text, encoding="utf-8", errors="surrogateescape")
    replace_part(tmp_path, "figures", [])
    assert json.loads((tmp_path / LIST).read_text())["figures"] == {}


def test_a_list_of_files_that_is_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / LIST)
    read = os.open(tmp_path / LIST, os.O_RDONLY | os.O_NONBLOCK)
    replace_part(tmp_path, "figures", [])
    os.close(read)


def test_nothing_behind_a_linked_folder_is_removed(tmp_path):
    """The list names a file by its content, which a stranger may know."""
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    out.mkdir()
    (elsewhere / "a.svg").write_text("")
    (out / "figures").symlink_to(elsewhere)
    empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    (out / LIST).write_text(json.dumps({"figures": {"figures/a.svg": empty}}))
    replace_part(out, "figures", [])
    assert (elsewhere / "a.svg").exists()


def test_a_checkpoint_that_unpacks_to_more_than_it_is_is_refused(tmp_path):
    file = tmp_path / "checkpoint.zip"
    write_plain({"format": "x", "weights": np.arange(50.0)}, file)
    assert read_plain(file)["format"] == "x"
    packed = io.BytesIO()
    np.save(packed, np.zeros(10_000_000))
    with zipfile.ZipFile(file, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("array_1.npy", packed.getvalue())
    with pytest.raises(ValueError, match="unpacked"):
        read_plain(file)


def simulate_into(folder: Path) -> None:
    Simulator("zheng-2021-a").run([{"t": 0.0}], 0.2).to_csv(folder / "swim.csv")


def plot_into(folder: Path) -> None:
    plot_fish(Console(quiet=True), "trim", "zheng-2021-a", folder, ["png", "svg", "pdf"])


WRITERS = {
    "swim.csv-metadata.json": simulate_into,
    "trim.png": plot_into,
    "trim.svg": plot_into,
    "trim.pdf": plot_into,
}
"""Name that a program chose -> what writes it into a folder."""


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_the_user_did_not_name_is_kept(name, mine, tmp_path):
    """Another file of that name is refused, a link too; what this program wrote is replaced."""
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).write_text("of the user")
    with pytest.raises(OutputError, match=rf"{name}: this program did not write it"):
        WRITERS[name](folder)
    assert [file.name for file in folder.iterdir()] == [name]
    (folder / name).unlink()
    (folder / name).symlink_to(mine)
    with pytest.raises(OutputError, match=rf"{name}: is a link"):
        WRITERS[name](folder)
    assert mine.read_text() == "of the user"
    (folder / name).unlink()
    WRITERS[name](folder)
    WRITERS[name](folder)
    assert (folder / name).stat().st_size > 100


def test_a_copy_of_a_diagnosis_replaces_no_file_of_the_user(mine, tmp_path):
    kept, copy = tmp_path / "kept", tmp_path / "copy"
    for folder in (kept, copy):
        (folder / "figures").mkdir(parents=True)
    (kept / "report.html").write_text("a report")
    (kept / "figures" / "gain.svg").write_text("a picture")
    found = DiagnoseResult({}, kept)
    (copy / "report.html").write_text("of the user")
    with pytest.raises(OutputError, match=r"report\.html: this program did not write it"):
        found.save(copy)
    (copy / "report.html").unlink()
    (copy / "gain.svg").symlink_to(mine)
    with pytest.raises(OutputError, match=r"gain\.svg: is a link"):
        found.plot(copy)
    assert mine.read_text() == "of the user"


def test_a_dataset_is_written_through_no_link(tmp_path):
    dataset, out = load_dataset(good_folder(tmp_path / "data")), tmp_path / "out"
    out.mkdir()
    for name in ("dataset.yaml", "r01.csv"):
        (out / name).symlink_to(tmp_path / "nowhere")
        with pytest.raises(DatasetError, match="already"):
            write_dataset(dataset, out)
        (out / name).unlink()
    assert not (tmp_path / "nowhere").exists()
