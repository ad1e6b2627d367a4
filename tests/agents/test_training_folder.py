"""A training's folder: refusals leave it as it was, and one training at a time uses it."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from fish_env.errors import ConfigError, OutputError
from fish_env.version import WRITER
from robofish_agents.training.config import Ppo, TrainConfig
from robofish_agents.training.lock import LOCK, locked
from robofish_agents.training.run import (
    CHECKPOINT,
    CONFIG,
    POLICY,
    config_bytes,
    holds_config,
    train,
)
from tests.agents.test_training import Quiet
from tests.command_line import run

ROOT = Path(__file__).resolve().parents[2]
TINY = TrainConfig(
    "tiny", "ppo", "hold", 256, num_envs=8, ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1)
)
HOLD = """
import sys, time
from pathlib import Path
from robofish_agents.training.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def contents(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Content and time of change of every file in a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {
        str(path.relative_to(folder)): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in files
    }


@pytest.fixture
def trained(tmp_path) -> Path:
    train(TINY, tmp_path, Quiet())
    return tmp_path


def test_a_refused_resume_changes_nothing(trained):
    before = contents(trained)
    with pytest.raises(ConfigError, match="another configuration"):
        train(replace(TINY, seed=3), trained, Quiet(), resume=True)
    assert contents(trained) == before


def test_a_resume_from_a_damaged_checkpoint_changes_nothing(trained):
    (trained / CHECKPOINT).write_bytes(b"half")
    (trained / CONFIG).write_text("with my remarks")
    before = contents(trained)
    with pytest.raises(ConfigError, match="not a readable checkpoint"):
        train(TINY, trained, Quiet(), resume=True)
    assert contents(trained) == before


def test_a_training_without_resume_changes_nothing(trained):
    before = contents(trained)
    with pytest.raises(ConfigError, match="--resume"):
        train(TINY, trained, Quiet())
    assert contents(trained) == before


def test_a_resume_keeps_remarks_in_the_configuration(trained):
    config = trained / CONFIG
    config.write_text("# chosen by me\n" + config.read_text())
    train(TINY, trained, Quiet(), resume=True)
    assert config.read_text().startswith("# chosen by me")


def test_a_stopped_start_begins_again_under_another_version(tmp_path):
    assert config_bytes(TINY).startswith(f"# Written by {WRITER}.\n".encode())
    (tmp_path / CONFIG).write_bytes(config_bytes(TINY).replace(b" 0.", b" 9.", 1))
    assert holds_config(tmp_path / CONFIG, TINY)
    train(TINY, tmp_path, Quiet())
    assert (tmp_path / CONFIG).read_bytes() == config_bytes(TINY)


@pytest.mark.parametrize("name", [CONFIG, POLICY, "card.yaml", "evaluations.csv"])
def test_files_of_someone_else_stay(name, tmp_path):
    (tmp_path / name).write_text("of the user")
    with pytest.raises(ConfigError, match=rf"{name}: this training did not write it"):
        train(TINY, tmp_path, Quiet())
    assert list(contents(tmp_path)) == [name]
    assert (tmp_path / name).read_text() == "of the user"


def test_a_configuration_in_its_own_folder_stays(tmp_path, capsys):
    """`robofish train config.yaml --out .` would replace it by one with every default."""
    file = tmp_path / CONFIG
    file.write_text("algorithm: ppo\ntask: hold\ntotal_steps: 256\n")
    status, _, error = run(capsys, "train", str(file), "--out", str(tmp_path))
    assert status == 2
    assert "config.yaml: is read and would be replaced" in error
    assert list(contents(tmp_path)) == [CONFIG]


def test_numbers_of_a_training_and_what_they_may_not_replace(tmp_path, capsys):
    file, numbers = tmp_path / "short.yaml", tmp_path / "numbers.json"
    small = "num_envs: 8\nppo: {n_steps: 16, batch_size: 128, n_epochs: 1}\n"
    file.write_text("algorithm: ppo\ntask: hold\ntotal_steps: 256\n" + small)
    arguments = ("train", str(file), "--out", str(tmp_path / "out"), "--json")
    status, _, error = run(capsys, *arguments, str(file))
    assert status == 2
    assert "short.yaml: is read and would be replaced" in error
    assert run(capsys, *arguments, str(numbers))[0] == 0
    found = json.loads(numbers.read_text())
    assert Path(found["policy"]).is_file()
    assert found["evaluations"][-1]["steps"] == found["steps"] == 256


def test_two_trainings_in_one_folder_do_not_collide(tmp_path):
    """The second is told which process trains; a kill lets go of the folder."""
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    first = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    try:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        before = contents(tmp_path)
        with pytest.raises(ConfigError, match=rf"process {first.pid} on .* trains here now"):
            train(TINY, tmp_path, Quiet())
        assert contents(tmp_path) == before
    finally:
        first.send_signal(signal.SIGKILL)
        first.wait()
    assert (tmp_path / LOCK).exists()
    train(TINY, tmp_path, Quiet())
    assert not (tmp_path / LOCK).exists()


def test_a_lock_is_let_go_after_an_error(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(TINY, tmp_path, Quiet(100))
    assert not (tmp_path / LOCK).exists()
    train(TINY, tmp_path, Quiet())


def test_one_process_cannot_hold_a_folder_twice(tmp_path):
    with locked(tmp_path), pytest.raises(ConfigError, match=str(os.getpid())), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass


def test_a_lock_that_was_removed_in_between_is_taken_anew(tmp_path, monkeypatch):
    """A file that its last holder removed after it was opened here locks nobody out."""
    from robofish_agents.training import lock

    flock, removed = lock.fcntl.flock, []

    def remove_first(opened: int, how: int) -> None:
        if not removed:
            removed.append((tmp_path / LOCK).unlink())
        flock(opened, how)

    monkeypatch.setattr(lock.fcntl, "flock", remove_first)
    with locked(tmp_path), pytest.raises(ConfigError, match="trains here now"), locked(tmp_path):
        pass
    assert removed


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=r"file/below/training\.lock: cannot be written"):
        train(TINY, tmp_path / "file" / "below", Quiet())


FULL = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from robofish_agents.training.command import run
from rich.console import Console
from fish_env.cli import main
from robofish_agents.training import run as training
write = training.save_checkpoint
def write_on_a_full_disk(*arguments):
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
    try:
        write(*arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
training.save_checkpoint = write_on_a_full_disk
sys.argv = ["robofish", "train", sys.argv[1], "--out", sys.argv[2], "--resume"]
main()
"""


def test_a_full_disk_leaves_the_last_checkpoint(tmp_path):
    """The system refuses to let the new one grow; one line names it, and the old one is whole."""
    longer = replace(TINY, total_steps=768, checkpoint_every=100)
    config, folder = tmp_path / "tiny.yaml", tmp_path / "run"
    config.write_text(yaml.safe_dump(longer.tree()))
    with pytest.raises(KeyboardInterrupt):
        train(longer, folder, Quiet(400))
    before = (folder / CHECKPOINT).read_bytes()
    command = [sys.executable, "-c", FULL, str(config), str(folder)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert "checkpoint.zip: cannot be written (File too large)" in result.stderr
    assert "Traceback" not in result.stderr
    assert (folder / CHECKPOINT).read_bytes() == before
    assert train(longer, folder, Quiet(), resume=True).progress.steps == 768
