"""Suites are frozen, episodes are those of single environments, results keep."""

from dataclasses import replace
from importlib.metadata import EntryPoint

import gymnasium as gym
import numpy as np
import pytest
import typer
import yaml
from typer.testing import CliRunner

from fish_env import cli
from fish_env.envs.registration import ENV_ID
from fish_env.envs.tasks import SIGNAL_TASKS, TASKS
from fish_env.errors import ConfigError
from robofish_agents.controllers import PIDController
from robofish_agents.episode import swim
from robofish_agents.evaluation.record import KEPT, swim_suite
from robofish_agents.evaluation.results import evaluate, read_results, write_results
from robofish_agents.evaluation.suites import RESERVED_SEEDS, load_suite, suite_names
from robofish_agents.registry import load_agents

EPISODES = 3
CALM = load_suite("calm")


EPISODES_OF = [(name, task) for name in suite_names() for task in load_suite(name).tasks]


@pytest.mark.parametrize(("name", "task"), EPISODES_OF)
def test_a_suite_begins_as_it_was_frozen(name, task):
    load_suite(name).check(task)


def test_every_task_has_suites_and_a_suite_says_which_tasks_it_has():
    for task in TASKS:
        assert suite_names(task)
    assert suite_names("hold") == suite_names("track") == ["calm", "current", "noisy", "hard"]
    assert load_suite("path/helix").tasks == ["path"]
    with pytest.raises(ConfigError, match="suite path/helix is of task path, not hold"):
        load_suite("path/helix").check("hold")


def test_a_suite_that_begins_otherwise_is_refused():
    other = replace(CALM, seed=CALM.seed + 1)
    with pytest.raises(ConfigError, match="suite calm version 1, task hold: its episodes differ"):
        other.check("hold")


def test_the_suites_have_seeds_of_their_own():
    seeds = [range(s.seed, s.seed + s.episodes) for s in map(load_suite, suite_names())]
    assert all(r.start in RESERVED_SEEDS and r.stop in RESERVED_SEEDS for r in seeds)
    assert len({seed for r in seeds for seed in r}) == sum(map(len, seeds))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"water": "salt"}, "unknown: \\['water'\\]"),
        ({"episodes": 0}, "'episodes' must be a whole number"),
        ({"fingerprint": {"swim": 1.0}}, "'fingerprint' one with a number for each"),
        ({"fingerprint": {}}, "'fingerprint' one with a number for each"),
    ],
)
def test_a_suite_with_a_mistake_is_refused(tmp_path, change, message):
    tree = {name: getattr(CALM, name) for name in vars(CALM)} | change
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(tree))
    with pytest.raises(ConfigError, match=message):
        load_suite(file)


def test_no_such_suite():
    with pytest.raises(ConfigError, match="'stormy': neither one of calm, current, noisy, hard"):
        load_suite("stormy")


@pytest.mark.parametrize("name", ["calm", "hard"])
def test_episodes_side_by_side_are_those_swum_one_by_one(name):
    suite = load_suite(name)
    together = swim_suite(suite, "track", PIDController(), EPISODES)
    env = gym.make(ENV_ID, task="track", **suite.environment)
    for lane in range(EPISODES):
        alone = swim(env, PIDController(), suite.seed + lane)
        steps = len(alone["time_s"])
        assert together.alive[:, lane].sum() == steps
        for key in KEPT:
            np.testing.assert_array_equal(together.info[key][:steps, lane], alone[key])


def test_an_ended_episode_keeps_its_last_values():
    class Dive:
        def reset(self, count):
            self.action = np.tile(np.array([0, 0.5, 0.5, -1, 0], np.float32), (count, 1))

        def act(self, observations):
            return self.action

    swum = swim_suite(CALM, "hold", Dive(), EPISODES)
    steps = swum.alive.sum(axis=0)
    assert np.all(steps < 400)
    for lane, last in enumerate(steps - 1):
        for values in swum.info.values():
            assert np.all(values[last:, lane] == values[last, lane])
        assert np.all(swum.reward[last + 1 :, lane] == 0.0)
        assert swum.info["failure"][-1, lane] > 0


def test_results_are_the_same_again_and_keep(tmp_path):
    first, again = (
        evaluate("pid", load_agents("pid", "hold"), CALM, "hold", EPISODES) for _ in range(2)
    )
    assert first == again
    assert first.metrics["success_rate"].mean == 1.0
    file = tmp_path / "results.json"
    write_results(file, [first], date="2026-01-01")
    (back,) = read_results(file)
    assert (back.agent, back.suite, back.task, back.episodes) == ("pid", "calm", "hold", EPISODES)
    for name, interval in first.metrics.items():
        assert back.metrics[name] == pytest.approx(interval, rel=1e-5)


@pytest.mark.parametrize("text", ["", "{}", '{"results": [{"agent": "pid"}]}'])
def test_what_are_no_results_is_refused(tmp_path, text):
    file = tmp_path / "results.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match="no results of `robofish evaluate`"):
        read_results(file)
    with pytest.raises(ConfigError, match="no such file"):
        read_results(tmp_path / "none.json")


def test_the_command_prints_and_writes(tmp_path):
    file = tmp_path / "pid.json"
    arguments = ["evaluate", "--agent", "pid", "--suite", "calm", "--episodes", "2"]
    result = CliRunner().invoke(cli.app, [*arguments, "--json", str(file)])
    assert result.exit_code == 0, result.output
    assert "pid, task hold: 2 episodes each" in result.output
    assert [r.task for r in read_results(file)] == list(SIGNAL_TASKS)


def test_the_command_measures_paths_and_places(tmp_path):
    file = tmp_path / "pid.json"
    for suite, own in (("path/helix", "cross_track_rmse_m"), ("station/current", "place_rmse_m")):
        arguments = ["evaluate", "--agent", "pid", "--suite", suite, "--episodes", "2"]
        result = CliRunner().invoke(cli.app, [*arguments, "--json", str(file)])
        assert result.exit_code == 0, result.output
        (back,) = read_results(file)
        assert (back.task, back.suite) == (suite.split("/")[0], suite)
        assert 0 < back.metrics[own].mean < 0.5


def test_an_unknown_agent_says_which_there_are(tmp_path):
    with pytest.raises(ConfigError, match="give pid, mppi, pretrained"):
        load_agents(str(tmp_path / "none.npz"), "hold")


def test_a_command_that_cannot_be_loaded_is_left_out_and_said(monkeypatch):
    broken = EntryPoint("fly", "agents.no_such_module:register", cli.GROUP)
    monkeypatch.setattr(cli, "entry_points", lambda group: [broken])
    with pytest.warns(UserWarning, match="command 'fly' is left out"):
        cli.add_commands(typer.Typer())
