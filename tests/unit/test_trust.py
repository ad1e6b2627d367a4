"""Reading never runs code: effect files beside data are run only where a caller trusts them."""

import json
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import pytest
import yaml

from fish_env import Simulator, load_fish
from fish_env.commands.case import read_case
from fish_env.comparison import compare
from fish_env.data import load_dataset
from fish_env.diagnosis import diagnose
from fish_env.effects import load_effect_file
from fish_env.effects.extended import build_model
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, EffectError, ParameterError, RoboticFishError
from fish_env.params import as_fish, save_fish
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.training.config import TrainConfig, load_train_config
from tests.command_line import run
from tests.fixtures.measured_data import good_folder, steady_folder

MARK = "code was run"
CODE = """
from pathlib import Path

Path(__file__).with_name("mark").write_text("run")
raise ValueError("code was run")
"""
SUITE = load_suite("calm")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Data from somewhere: their fish names an effect, and a Python file of that name is there."""
    (tmp_path / "fish.yaml").write_text(
        "base: zheng-2021-a\nname: theirs\neffects: {readme: {size: 1.0}}\n"
    )
    (tmp_path / "readme.py").write_text(CODE)
    good_folder(tmp_path / "runs", fish="../fish.yaml")
    steady_folder(tmp_path / "steady", fish="../fish.yaml")
    case = {"fish": "fish.yaml", "duration_s": 1.0, "schedule": [{"t": 0.0}]}
    (tmp_path / "case.json").write_text(json.dumps(case))
    environment = {"fish": str(tmp_path / "fish.yaml")}
    suite = {name: getattr(SUITE, name) for name in vars(SUITE)} | {"environment": environment}
    (tmp_path / "suite.yaml").write_text(yaml.safe_dump(suite))
    training = {"algorithm": "ppo", "task": "hold", "total_steps": 1000}
    (tmp_path / "train.yaml").write_text(yaml.safe_dump(training | {"environment": environment}))
    under = training | {"disturbances": [str(tmp_path / "suite.yaml")]}
    (tmp_path / "under.yaml").write_text(yaml.safe_dump(under))
    return tmp_path


COMMANDS = {
    "info": "info --fish {0}/fish.yaml",
    "compare runs": "compare {0}/runs",
    "compare steady": "compare {0}/steady",
    "compare another fish": "compare msu-steady --fish {0}/fish.yaml",
    "simulate": "simulate {0}/case.json --dt 0.01",
    "plot": "plot forces --fish {0}/fish.yaml --out {0}/out",
    "swim": "swim --suite {0}/suite.yaml --out {0}/out",
    "evaluate": "evaluate --agent pid --suite {0}/suite.yaml --task hold",
    "train": "train {0}/train.yaml --out {0}/out",
    "train in a suite": "train {0}/under.yaml --out {0}/out",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_runs_code_that_lies_beside_data(command, folder, capsys):
    """The refusal names the file that would be run and the option; with it, the file is run."""
    words = COMMANDS[command].format(folder).split()
    status, _, error = run(capsys, *words)
    assert status == 2
    assert str(folder / "readme.py") in error
    assert "--trust-effects" in error
    assert not (folder / "mark").exists()
    status, _, error = run(capsys, *words, "--trust-effects")
    assert MARK in error
    assert (folder / "mark").exists()


@pytest.mark.parametrize("command", ["diagnose", "fit"])
def test_neither_do_commands_that_need_good_runs(command, folder, capsys, monkeypatch):
    """What they refuse before is left out, so that they come as far as the fish."""
    for module in ("fish_env.diagnosis.pipeline", "fish_env.commands.fit"):
        monkeypatch.setattr(f"{module}.check_runs", lambda dataset: None)
    words = [command, str(folder / "runs"), "--out", str(folder / "out.yaml")]
    assert "--trust-effects" in run(capsys, *words)[2]
    assert not (folder / "mark").exists()
    assert MARK in run(capsys, *words, "--trust-effects")[2]


def test_a_replay_never_needs_the_code(folder, capsys):
    """It draws the fish's size, with the case's commands."""
    page = str(folder / "page.html")
    for words in (
        [str(folder / "runs" / "r01.csv")],
        [str(folder / "runs" / "r01.csv"), "--case", str(folder / "case.json")],
    ):
        assert run(capsys, "replay", *words, "--out", page)[0] == 0
    assert not (folder / "mark").exists()


def trained(folder: Path, trust: bool) -> object:
    return load_train_config(folder / "train.yaml", trust)


IN_PYTHON = {
    "Simulator": lambda f, t: Simulator(f / "fish.yaml", trust_effects=t),
    "Simulator with parameters": lambda f, t: Simulator(
        load_fish(f / "fish.yaml"), trust_effects=t
    ),
    "load_fish": lambda f, t: build_model(load_fish(f / "fish.yaml", trust_effects=t)),
    "replace": lambda f, t: build_model(
        as_fish(f / "fish.yaml", t).replace({"mass.buoyancy": 2.001})
    ),
    "effects": lambda f, t: Simulator(
        replace(as_fish(f / "fish.yaml", t), effects={}), effects={"readme": {"size": 2.0}}
    ),
    "gym.make": lambda f, t: gym.make(
        "fish_env:RoboticFish3D-v0", fish=f / "fish.yaml", trust_effects=t
    ),
    "gym.make_vec": lambda f, t: gym.make_vec(
        "fish_env:RoboticFish3D-v0", num_envs=2, fish=f / "fish.yaml", trust_effects=t
    ),
    "vector": lambda f, t: RoboticFish3DVectorEnv(2, fish=f / "fish.yaml", trust_effects=t),
    "compare": lambda f, t: compare(load_dataset(f / "runs"), trust_effects=t),
    "compare steady": lambda f, t: compare(load_dataset(f / "steady"), trust_effects=t),
    "case": lambda f, t: build_model(read_case(f / "case.json", t).fish),
    "suite": lambda f, t: load_suite(f / "suite.yaml", t).make("hold"),
    "training": trained,
    "training in Python": lambda f, t: TrainConfig(
        "mine", "ppo", "hold", 10, environment={"fish": f / "fish.yaml"}, trust_effects=t
    ),
}


@pytest.mark.parametrize("way", IN_PYTHON)
def test_no_way_in_from_python_runs_it_untrusted(way, folder):
    with pytest.raises(RoboticFishError, match="trust_effects=True") as caught:
        IN_PYTHON[way](folder, False)
    assert str(folder / "readme.py") in str(caught.value)
    assert not (folder / "mark").exists()
    with pytest.raises(RoboticFishError, match=MARK):
        IN_PYTHON[way](folder, True)
    assert (folder / "mark").exists()


def test_a_diagnosis_from_python_carries_the_trust(folder, monkeypatch):
    monkeypatch.setattr("fish_env.diagnosis.pipeline.check_runs", lambda dataset: None)
    with pytest.raises(EffectError, match="trust_effects=True"):
        diagnose(folder / "runs")
    assert not (folder / "mark").exists()
    with pytest.raises(EffectError, match=MARK):
        diagnose(folder / "runs", trust_effects=True)


@pytest.mark.parametrize("name", ["../readme", "readme.py", "a/b", "", "read me"])
def test_an_effect_whose_name_is_a_path_is_unknown(name, folder):
    (folder / "below").mkdir()
    file = folder / "below" / "fish.yaml"
    file.write_text(
        yaml.safe_dump({"base": "zheng-2021-a", "name": "x", "effects": {name: {"size": 1.0}}})
    )
    with pytest.raises(EffectError, match="unknown effect"):
        build_model(load_fish(file, trust_effects=True))
    assert not (folder / "mark").exists()


def test_no_file_can_say_that_it_is_trusted(folder):
    fish = folder / "fish.yaml"
    fish.write_text(fish.read_text() + "trust_effects: true\n")
    with pytest.raises(ParameterError, match="unknown key trust_effects"):
        load_fish(fish)
    for name, where in (("suite", "environment"), ("train", "environment"), ("train", None)):
        file = folder / f"{name}.yaml"
        tree = yaml.safe_load(file.read_text())
        (tree[where] if where else tree)["trust_effects"] = True
        (folder / "own.yaml").write_text(yaml.safe_dump(tree))
        load = load_suite if name == "suite" else load_train_config
        with pytest.raises(ConfigError, match="no file can say that it is trusted"):
            load(folder / "own.yaml")
    assert not (folder / "mark").exists()


def test_neither_trust_nor_a_trace_of_it_is_written(tmp_path):
    """What one user trusted, the next one has not read."""
    save_fish(replace(load_fish("zheng-2021-a"), trust_effects=True), tmp_path / "fish.yaml")
    assert "trust" not in (tmp_path / "fish.yaml").read_text()
    assert not load_fish(tmp_path / "fish.yaml").trust_effects
    assert "trust_effects" not in TrainConfig("a", "ppo", "hold", 10, trust_effects=True).tree()


def test_the_effects_of_the_package_and_those_given_in_python_need_no_trust(tmp_path):
    fish = load_fish("zheng-2021-a")
    on = {"servo_lag": {"time_constant": 0.05}, "cable_drag": {"coefficient": 0.5}}
    cable = load_effect_file(Path(__file__).resolve().parents[2] / "examples" / "cable_drag.py")
    assert set(build_model(fish, on, [cable]).effects) == set(on)
    save_fish(replace(fish, effects=on), tmp_path / "fish.yaml")
    model = build_model(load_fish(tmp_path / "fish.yaml"), user_effects=[cable])
    assert set(model.effects) == set(on)
