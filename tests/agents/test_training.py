"""Trainings: resumed to the bit after any stop, honest about what is in a folder."""

import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from fish_env.errors import ConfigError
from robofish_agents.policies import read_policy
from robofish_agents.training.config import Evaluation, History, Imitation, Ppo, Sac, TrainConfig
from robofish_agents.training.run import CHECKPOINT, POLICY, Outcome, train
from robofish_agents.training.settings import LearningRate

ROOT = Path(__file__).resolve().parents[2]
PPO = TrainConfig(
    "tiny", "ppo", "hold", 2048, num_envs=8, disturbances=("calm", "noisy"),
    ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1), history=History(2, (0.5,)),
    imitate=Imitation(1, 1),
    evaluation=Evaluation(every=700, episodes=2), checkpoint_every=300,
)  # fmt: skip
SAC = replace(
    PPO,
    algorithm="sac",
    imitate=Imitation(),
    total_steps=600,
    sac=Sac(2000, batch_size=32, gradient_steps=1, learning_starts=100),
)


class Quiet:
    """Watches, and stops the training at a step as a kill would."""

    def __init__(self, stop_at: float = np.inf) -> None:
        self.stop_at = stop_at
        self.steps: list[int] = []

    def stepped(self, steps: int) -> None:
        self.steps.append(steps)
        if steps >= self.stop_at:
            raise KeyboardInterrupt

    def evaluated(self, row: dict[str, float]) -> None:
        pass


def numbers(outcome: Outcome) -> list[np.ndarray]:
    """Weights and normalisation of a trained policy."""
    network = read_policy(outcome.policy).network
    return [network.mean, network.scale, *network.weights, *network.biases]


def same(one: Outcome, other: Outcome) -> bool:
    pairs = zip(numbers(one), numbers(other), strict=True)
    timeless = [
        [{k: v for k, v in row.items() if k != "cpu_s"} for row in outcome.progress.evaluations]
        for outcome in (one, other)
    ]
    return all(np.array_equal(a, b) for a, b in pairs) and timeless[0] == timeless[1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Outcome:
    return train(PPO, tmp_path_factory.mktemp("whole"), Quiet())


@pytest.mark.parametrize("stop_at", [100, 1000, 1999])
def test_a_stopped_training_goes_on_to_the_same_bits(stop_at, whole, tmp_path):
    """Before the first checkpoint, in the middle, and near the end."""
    with pytest.raises(KeyboardInterrupt):
        train(PPO, tmp_path, Quiet(stop_at))
    watcher = Quiet()
    resumed = train(PPO, tmp_path, watcher, resume=True)
    assert same(resumed, whole)
    assert resumed.progress.steps == whole.progress.steps == 2048
    lost = stop_at - (watcher.steps[0] - PPO.num_envs)
    assert lost <= PPO.checkpoint_every + PPO.ppo.n_steps * PPO.num_envs


def test_another_seed_learns_something_else(whole, tmp_path):
    """The comparison above can tell two trainings apart."""
    other = train(replace(PPO, seed=1), tmp_path, Quiet())
    assert not same(other, whole)


def test_a_stopped_sac_keeps_its_replay_buffer(tmp_path):
    one = train(SAC, tmp_path / "whole", Quiet())
    with pytest.raises(KeyboardInterrupt):
        train(SAC, tmp_path / "stopped", Quiet(450))
    assert same(train(SAC, tmp_path / "stopped", Quiet(), resume=True), one)


def test_a_training_leaves_no_thread_behind(tmp_path):
    """The writer of the TensorBoard log has one."""
    short = replace(PPO, total_steps=256, imitate=Imitation())
    before = threading.active_count()
    train(short, tmp_path / "finished", Quiet())
    with pytest.raises(KeyboardInterrupt):
        train(short, tmp_path / "stopped", Quiet(100))
    assert threading.active_count() == before


def test_a_finished_training_is_not_trained_further(whole, tmp_path):
    watcher = Quiet()
    folder = whole.policy.parent
    again = train(PPO, folder, watcher, resume=True)
    assert watcher.steps == []
    assert again.progress.steps == 2048


def test_a_folder_in_use_is_not_overwritten(whole):
    with pytest.raises(ConfigError, match="--resume"):
        train(PPO, whole.policy.parent, Quiet())


def test_a_checkpoint_of_another_configuration_is_refused(whole):
    with pytest.raises(ConfigError, match="seed was 0, is 5"):
        train(replace(PPO, seed=5), whole.policy.parent, Quiet(), resume=True)


def test_a_damaged_checkpoint_is_refused(tmp_path):
    (tmp_path / CHECKPOINT).write_bytes(b"half a file")
    with pytest.raises(ConfigError, match="move it away"):
        train(PPO, tmp_path, Quiet(), resume=True)


def test_the_folder_says_what_was_done(whole):
    folder = whole.policy.parent
    card = yaml.safe_load((folder / "card.yaml").read_text())
    assert card["environment"] == "RoboticFish3D-v0"
    assert card["configuration"] == PPO.tree()
    assert card["training"]["cpu_s"] > 0
    assert read_policy(folder / POLICY).card == card
    rows = (folder / "evaluations.csv").read_text().splitlines()
    assert len(rows) == 1 + len(whole.progress.evaluations)
    assert list((folder / "tensorboard").iterdir())


@pytest.mark.parametrize("config", [PPO, SAC], ids=["ppo", "sac"])
def test_a_training_that_diverges_says_so(config, tmp_path):
    own = replace(getattr(config, config.algorithm), learning_rate=LearningRate(1e30))
    with pytest.raises(ConfigError, match=rf"diverged.*{config.algorithm}\.learning_rate\.start"):
        train(replace(config, **{config.algorithm: own}), tmp_path, Quiet())


@pytest.mark.slow
def test_kill_9_in_mid_training_then_resume(tmp_path):
    """`scripts/train.py` in its own process, killed once its first checkpoint is there."""
    longer = replace(
        PPO,
        total_steps=12_000,
        checkpoint_every=2_000,
        evaluation=Evaluation(every=10_000, episodes=2),
    )
    config = tmp_path / "tiny.yaml"
    config.write_text(yaml.safe_dump(longer.tree()))
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "scripts.train", str(config), "--out", str(folder)]
    first = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not (folder / CHECKPOINT).exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    first.send_signal(signal.SIGKILL)
    assert first.wait() == -signal.SIGKILL
    rest = subprocess.run(
        [*command, "--resume"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert "12,032 steps" in rest.stdout
    resumed = train(longer, folder, Quiet(), resume=True)
    assert same(resumed, train(longer, tmp_path / "unbroken", Quiet()))
