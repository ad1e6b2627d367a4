"""Training configurations: what is refused, with file and key, and what the shipped ones say."""

from pathlib import Path

import pytest
import yaml

from fish_env.errors import ConfigError
from fish_env.params.io import config_root
from robofish_agents.evaluation.suites import RESERVED_SEEDS
from robofish_agents.training import stack, trial
from robofish_agents.training.config import MOST_FISH, load_train_config

SHIPPED = sorted(file.stem for file in (config_root() / "train").glob("*.yaml"))
GOOD = {"algorithm": "ppo", "task": "hold", "total_steps": 1000}


def written(tmp_path: Path, **changes: object) -> Path:
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(GOOD | changes))
    return path


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_configuration_reads_and_writes(name, tmp_path):
    config = load_train_config(name)
    assert config.name == name
    path = tmp_path / "again.yaml"
    path.write_text(yaml.safe_dump(config.tree()))
    assert load_train_config(path) == config


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"algoritm": "ppo"}, "unknown key 'algoritm'"),
        ({"algorithm": "dqn"}, "algorithm: ppo or sac"),
        ({"task": "juggle"}, "juggle"),
        ({"total_steps": 0}, "positive"),
        ({"total_steps": "many"}, "total_steps must be a whole number, got 'many'"),
        ({"total_steps": 10.5}, "total_steps must be a whole number"),
        ({"num_envs": MOST_FISH + 1}, "num_envs"),
        ({"seed": -1}, "seed"),
        ({"ppo": {"learning_rat": 1}}, "ppo: unknown key 'learning_rat'"),
        ({"ppo": {"learning_rate": {"start": -1}}}, "learning_rate.start"),
        ({"ppo": {"learning_rate": 3}}, "must be a mapping"),
        ({"ppo": {"gamma": 1.5}}, "gamma"),
        ({"ppo": {"batch_size": 1000}}, "divide"),
        ({"sac": {"tau": 0.1}}, "'sac' has no effect"),
        ({"network": {"layers": []}}, "layers"),
        ({"network": {"layers": 64}}, "must be a list"),
        ({"network": {"activation": "gelu"}}, "activation"),
        ({"network": {"first_action": [0.0, 2.0, 0.0, 0.0, 0.0]}}, "first_action"),
        ({"network": {"first_action": [0.5]}}, "first_action"),
        ({"imitate": {"gains": {"depht": 1.0}}}, "unknown gain .depht."),
        ({"imitate": {"gains": {"hurry": "much"}}}, "finite number"),
        ({"imitate": {"stretch": 0.0}}, "stretch > 0"),
        ({"engine": "tensor", "critic": {"layers": [0]}}, "critic.layers: positive"),
        ({"engine": "tensor", "teacher": {"distil_steps": 9}}, "teacher.distil_steps: needs steps"),
        (
            {"engine": "tensor", "teacher": {"log_std_end": 0.0}},
            "log_std_end: at most log_std_init",
        ),
        ({"teacher": {"steps": 9}}, "teacher: engine sb3 has none"),
        ({"history": {"frames": 0}}, "frames"),
        ({"history": {"low_pass_s": [0.01]}}, "low_pass_s"),
        ({"environment": {"curent": [0, 0, 0]}}, "unknown key 'curent'"),
        ({"environment": {"current": [0, 0]}}, "three speeds"),
        ({"environment": {"task": "hold"}}, "task"),
        ({"settings": {"reward": {"weights": {"depht": 1.0}}}}, "depht"),
        ({"disturbances": ["storm"]}, "storm"),
        ({"disturbances": "calm"}, "must be a list"),
        ({"disturbances": []}, "at least one"),
        ({"disturbances": ["calm", "hard", "noisy"]}, "the same number"),
        ({"normalise_reward": 1}, "true or false"),
        ({"threads": {"torch": 0}}, "threads"),
    ],
)
def test_what_cannot_be_is_refused_with_its_file(changes, message, tmp_path):
    path = written(tmp_path, **changes)
    with pytest.raises(ConfigError, match=message) as caught:
        load_train_config(path)
    assert str(path) in str(caught.value) or "storm" in message


def test_a_missing_key_is_named(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("algorithm: ppo\ntask: hold\n")
    with pytest.raises(ConfigError, match="'total_steps' is missing"):
        load_train_config(path)


def test_an_unknown_name_lists_what_there_is():
    with pytest.raises(ConfigError, match="ppo-hold"):
        load_train_config("no-such-training")


def test_changes_replace_what_the_file_says(tmp_path):
    config = load_train_config(written(tmp_path), seed=3, total_steps=None)
    assert (config.name, config.seed, config.total_steps) == ("mine", 3, 1000)


def test_settings_of_a_training_do_not_hold_on_the_side(tmp_path):
    path = written(
        tmp_path, disturbances=["noisy"], settings={"reward": {"margins": {"depth": 0.05}}}
    )
    config = load_train_config(path)
    assert config.options("noisy", training=True)["config"]["reward"]["margins"]["depth"] == 0.05
    assert "config" not in config.options("noisy", training=False)
    assert config.options("noisy", training=False)["observation_delay_s"] > 0


def test_trainings_evaluations_and_suites_share_no_seed():
    assert max(RESERVED_SEEDS) < trial.FIRST_SEED
    assert trial.FIRST_SEED + 100_000 < stack.FIRST_SEED
