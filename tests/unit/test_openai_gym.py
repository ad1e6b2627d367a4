"""The environment with the calls of OpenAI gym before 0.26, tried with a stand-in for gym.

`make clients` runs CleanRL's SAC on it with gym itself.
"""

import importlib
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType, SimpleNamespace

import gymnasium
import numpy as np
import pytest

from fish_env.envs.registration import ENV_ID, register_with_gym

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def gym(monkeypatch):
    """A stand-in for gym 0.23.1; `registered` holds what is registered with it."""
    names = ("gym", "gym.envs", "gym.envs.registration", "gym.version")
    modules = {name: ModuleType(name) for name in names}
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, "fish_env.envs.openai_gym", raising=False)
    top = modules["gym"]
    top.Env, top.registered = object, {}
    top.spaces = SimpleNamespace(Box=gymnasium.spaces.Box)
    top.version, modules["gym.version"].VERSION = modules["gym.version"], "0.23.1"
    modules["gym.envs.registration"].register = lambda name, **spec: top.registered.update(
        {name: spec}
    )
    yield top
    sys.modules.pop("fish_env.envs.openai_gym", None)


def make(gym, **options):
    register_with_gym()
    module, _, name = gym.registered[ENV_ID]["entry_point"].partition(":")
    return getattr(importlib.import_module(module), name)(**options)


def test_it_swims_as_the_environment_of_gymnasium(gym):
    old, new = make(gym, task="track"), gymnasium.make(ENV_ID, task="track")
    assert (old.action_space, old.observation_space) == (new.action_space, new.observation_space)
    old.seed(5)
    first, _ = new.reset(seed=5)
    np.testing.assert_array_equal(old.reset(), first)
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (20, 5)):
        observation, reward, done, info = old.step(action)
        expected = new.step(action)
        np.testing.assert_array_equal(observation, expected[0])
        assert (reward, done, info) == (expected[1], False, expected[4])


def test_a_failure_is_done(gym):
    env = make(gym)
    observation, info = env.reset(seed=1, return_info=True, options={"goal": {"depth": 0.1}})
    assert observation.shape == (33,)
    assert info["goal_depth"] == pytest.approx(0.1)
    up = np.array([0.0, 1.0, 1.0, 1.0, 0.0])
    assert any(env.step(up)[2] for _ in range(400)), "it leaves the tank at the surface"


def test_gym_finds_it_and_limits_its_time(gym):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    ((name, value),) = project["entry-points"]["gym.envs"].items()
    assert EntryPoint(name, value, "gym.envs").load() is register_with_gym
    register_with_gym()
    assert gym.registered[ENV_ID]["max_episode_steps"] == 400


def test_a_gym_with_the_calls_of_gymnasium_gets_none(gym):
    gym.version.VERSION = "0.26.2"
    register_with_gym()
    assert gym.registered == {}
