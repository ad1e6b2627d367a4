"""Which library learns: chosen by file or option, refused in one line where it cannot."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from fish_env.errors import ConfigError
from robofish_agents.training.config import Ppo, load_train_config
from robofish_agents.training.run import CHECKPOINT, train
from tests.agents.test_training import PPO, SAC, Quiet
from tests.command_line import run

ROOT = Path(__file__).resolve().parents[2]
WITHOUT_RAY = """
import sys
sys.modules["ray"] = None  # what an import meets where it is not installed
sys.argv = ["robofish", "train", sys.argv[1], "--engine", "rllib", "--out", sys.argv[2]]
from fish_env.cli import main
main()
"""


def test_the_usual_engine_is_not_written_so_that_earlier_runs_go_on():
    assert PPO.engine == "sb3"
    assert "engine" not in PPO.tree()
    assert replace(PPO, engine="rllib").tree()["engine"] == "rllib"


def test_the_option_replaces_the_files_choice(tmp_path):
    file = tmp_path / "tiny.yaml"
    file.write_text(yaml.safe_dump(PPO.tree() | {"engine": "rllib"}))
    assert load_train_config(file).engine == "rllib"
    assert load_train_config(file, engine="sb3").engine == "sb3"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"ppo": replace(PPO.ppo, target_kl=0.02)}, "ppo.target_kl: .* remove it"),
        ({"ppo": replace(PPO.ppo, use_sde=True)}, "ppo.use_sde: .* remove it"),
        ({"engine": "torchrl"}, "engine: one of sb3, rllib"),
    ],
)
def test_what_rllib_has_no_equal_of_is_refused(changed, message):
    with pytest.raises(ConfigError, match=message):
        replace(PPO, **({"engine": "rllib"} | changed))


def test_rllib_trains_ppo_alone(capsys, tmp_path):
    file = tmp_path / "sac.yaml"
    file.write_text(yaml.safe_dump(SAC.tree()))
    status, _, shown = run(capsys, "train", str(file), "--engine", "rllib", "--out", str(tmp_path))
    assert status == 2
    assert "algorithm: engine rllib has no equal; choose ppo, or train with --engine sb3" in shown
    assert "Traceback" not in shown
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sac.yaml"]


def test_without_ray_one_line_says_what_to_install(tmp_path):
    file, out = tmp_path / "tiny.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump(PPO.tree()))
    command = [sys.executable, "-c", WITHOUT_RAY, str(file), str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "engine rllib needs the package 'ray', which is not installed" in done.stderr
    assert "pip install" in done.stderr
    assert "ray[tune]" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(out.iterdir()) == []


def test_a_checkpoint_of_another_engine_is_refused(tmp_path, monkeypatch):
    from robofish_agents.training import checkpoint, run

    short = replace(PPO, total_steps=256, ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1))
    train(short, tmp_path, Quiet())
    before = (tmp_path / CHECKPOINT).read_bytes()
    with pytest.raises(ConfigError, match="engine was 'sb3', is 'rllib'"):
        checkpoint.load_checkpoint(
            tmp_path / CHECKPOINT, replace(short, engine="rllib"), run.make_stack(short), print
        )
    assert (tmp_path / CHECKPOINT).read_bytes() == before
