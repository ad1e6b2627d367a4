"""`robofish swim` writes what it was asked for, and says what is missing."""

import base64
import json
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import fish_env  # noqa: F401
from fish_env import cli
from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from robofish_agents.controllers import PIDController
from robofish_agents.episode import swim
from robofish_agents.keep import Keeper
from robofish_agents.swimming import read_waypoints


@pytest.fixture
def waypoints(tmp_path) -> Path:
    file = tmp_path / "path.csv"
    file.write_text("north,east,depth\n0,0,0.4\n1,0,0.4\n1,1,0.5\n")
    return file


def run(*arguments: object) -> str:
    result = CliRunner().invoke(cli.app, ["swim", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
def test_it_swims_a_task_and_writes_a_replay(tmp_path):
    page = tmp_path / "swim.html"
    said = run("--agent", "pid", "--task", "hold", "--out", tmp_path, "--replay", page)
    assert "A success" in said
    assert {p.name for p in tmp_path.glob("*.png")} == {
        "path.png",
        "tracking.png",
        "actuators.png",
    }
    data = re.search(
        r'<script type="application/json"[^>]*>(.*?)</script>', page.read_text("utf-8")
    )
    assert data is not None
    fish, goal = json.loads(data[1])["groups"][0]["tracks"]
    assert goal["role"] == "goal"
    assert {"z", "yaw", "speed"} == set(goal["channels"])
    depths = [unpacked(track["channels"]["z"])[-100:] for track in (fish, goal)]
    assert abs(np.mean(depths[0]) - np.mean(depths[1])) < 0.05, "the fish is at its goal in the end"


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<f4")


@pytest.mark.slow
def test_it_follows_a_path_and_stops_at_its_end(tmp_path, waypoints):
    said = run("--path", waypoints, "--out", tmp_path)
    assert "it followed 2 of 2 legs" in said
    assert {p.name for p in tmp_path.glob("*.png")} == {"path.png", "actuators.png"}


@pytest.mark.parametrize("text", ["north,east\n0,0\n1,1\n", "north,east,depth\n0,0,a\n1,1,1\n"])
def test_what_are_no_waypoints_is_refused(tmp_path, text):
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"path\.csv.*north,east,depth"):
        read_waypoints(file)
    with pytest.raises(ConfigError, match="no such file"):
        read_waypoints(tmp_path / "none.csv")


def test_waypoints_are_read(waypoints):
    np.testing.assert_array_equal(read_waypoints(waypoints)[-1], [1.0, 1.0, 0.5])


def test_a_kept_motion_is_that_of_the_fish_without_jumps():
    env = gym.make(ENV_ID, task="hold", max_episode_steps=50)
    keeper = Keeper(env.unwrapped, scenes=False)
    episode = swim(env, PIDController(), 4, report=keeper)
    kept = keeper.trajectory()
    at = np.interp(episode["time_s"], kept.time_s, kept["z"])
    np.testing.assert_allclose(at[:-1], episode["depth"][:-1], atol=1e-3)
    assert np.all(np.diff(kept["tail_phase"]) >= 0.0)
    assert np.max(np.abs(np.diff(kept["qw"]))) < 0.1
